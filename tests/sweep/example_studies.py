"""Laying: studies of tests, from committed ones with lines changed, and quick runners."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from engine.batch.batch import Batch, BatchResult, EventKind
from language.overlays.expand_document import Project, parse_document, read_document
from language.text.diagnostic import Problems, Source
from sweep.definition.study import Study
from sweep.definition.study_reader import read_study
from sweep.execution.executor import BlockResult, SerialExecutor
from sweep.execution.prepare_study import prepare_study
from sweep.store.block_file import import_arrow
from sweep.store.row import Block
from sweep.store.store import Store

STUDIES = Path(__file__).parent.parent / "data" / "studies"


def make_study(
    name: str = "grid", *changes: tuple[str, str], problems: Problems | None = None
) -> Study:
    """Return a prepared study of the tests, with texts in its file replaced; fills `problems`."""
    project = Project(STUDIES)
    path = project.path_of(name)
    text = path.read_text("utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    source = Source(str(path), tuple(text.split("\n")))
    document = parse_document(source, text) if changes else read_document(path)
    return prepare_study(read_study(document, project, problems=problems))


def quick_results(batch: Batch) -> BatchResult:
    """Return results that are made of the values of the variants, without a simulation."""
    values = [*batch.parameters.values(), *batch.initial.values()]
    total = np.zeros(batch.count)
    for name, stimulus in batch.scenario.inputs.items():
        table = batch.inputs.get(name)
        values.append(table.values[:, -1] if table else total + float(stimulus.pieces[-1].value))
    for each in values:
        total = total + each
    assert batch.seeds is not None
    total = total + np.sin(batch.seeds)
    times = np.array([0.0, 1.0, 2.0])
    kinds = (EventKind("oscillator", "below", "above", "below"),)
    events = np.full((batch.count, batch.max_events), math.nan)
    events[:, 0] = 0.5 + 0.1 * np.cos(total)
    numbers = np.where(np.isnan(events), -1, 0).astype(np.int32)
    return BatchResult(
        statistics={},
        outputs={name: np.stack([total, -total, total / 2], axis=1) for name in batch.outputs},
        times=times,
        kinds=kinds,
        event_counts=np.ones(batch.count, dtype=np.int64),
        event_times=events,
        event_kinds=numbers,
        faults={},
        stopped={},
    )


QUICK_EXECUTOR = SerialExecutor(quick_results)


class ReversedExecutor:
    """An executor that computes the last block first."""

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        yield from QUICK_EXECUTOR(study, reversed(list(blocks)))


def store_rows(store: Store) -> list[dict[str, object]]:
    """Return all rows of a store in the order of their files."""
    tables = [import_arrow().parquet.read_table(path) for path in store.paths()]
    return [row for table in tables for row in table.to_pylist()]
