"""Laying: studies of tests, from committed ones with lines changed, and quick runners."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from engine.batch import Batch, BatchResult, EventKind
from language.problem import Problems, Source
from language.project import Project, document_of, read_document
from sweep.block import Block
from sweep.executor import Finished, InProcess
from sweep.preparation import prepared
from sweep.rows_file import arrow_module
from sweep.store import Store
from sweep.study import Study
from sweep.study_reader import read_study

STUDIES = Path(__file__).parent.parent / "data" / "studies"


def study(name: str = "grid", *changes: tuple[str, str], problems: Problems | None = None) -> Study:
    """Return a prepared study of the tests, with texts in its file replaced; fills `problems`."""
    project = Project(STUDIES)
    path = project.path_of(name)
    text = path.read_text("utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    source = Source(str(path), tuple(text.split("\n")))
    document = document_of(source, text) if changes else read_document(path)
    return prepared(read_study(document, project, problems=problems))


def quick(batch: Batch) -> BatchResult:
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
    events = np.full((batch.count, batch.most_events), math.nan)
    events[:, 0] = 0.5 + 0.1 * np.cos(total)
    numbers = np.where(np.isnan(events), -1, 0).astype(np.int32)
    return BatchResult(
        measures={},
        outputs={name: np.stack([total, -total, total / 2], axis=1) for name in batch.outputs},
        times=times,
        kinds=kinds,
        event_counts=np.ones(batch.count, dtype=np.int64),
        event_times=events,
        event_kinds=numbers,
        faults={},
        stopped={},
    )


QUICK = InProcess(quick)


class Backwards:
    """An executor that computes the last block first."""

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[Finished]:
        yield from QUICK(study, reversed(list(blocks)))


def content(store: Store) -> list[dict[str, object]]:
    """Return all rows of a store in the order of their files."""
    tables = [arrow_module().parquet.read_table(path) for path in store.paths()]
    return [row for table in tables for row in table.to_pylist()]
