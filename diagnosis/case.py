"""Case: what is diagnosed - a model, a map, recordings - and how its recordings are read."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from diagnosis.bench import Bench, balance_drifts
from diagnosis.layers import shipped_effects
from diagnosis.recipe import node_text
from diagnosis.series import Series, pieces_of
from diagnosis.shelf import Shelf, hash_of
from diagnosis.threshold import EVERYWHERE, Thresholds
from engine.recording import Recording, read_recording
from language.document import Document
from language.effect import Effect
from language.experiment import RecordingMap
from language.model import Automaton
from language.project import Project

Bootstrap = Literal["never", "kept", "made"]
"""Whether thresholds of a bootstrap are used: never, where one has left them, always."""


@dataclass(frozen=True)
class Case:
    """What is diagnosed: an expanded automaton, a map, and recordings.

    `names` are those of files whose bare name is not theirs alone, `read` what was read already,
    `opened` what is read on the way.
    In the folder `stages` it is kept what was found, so that a diagnosis that was ended goes on
    from there. `before` is called before each fit: it may raise what ends the diagnosis.
    """

    document: Document
    project: Project
    mapping: RecordingMap
    train: tuple[Path, ...]
    held_out: tuple[Path, ...] = ()
    effects: tuple[Effect, ...] | None = None
    thresholds: Thresholds = EVERYWHERE
    bootstrap: Bootstrap = "never"
    names: Mapping[Path, str] = field(default_factory=dict)
    read: Mapping[Path, Recording] = field(default_factory=dict, repr=False)
    opened: dict[Path, Recording] = field(default_factory=dict, repr=False)
    stages: Path | None = None
    before: Callable[[], None] = lambda: None

    def name_of(self, path: Path) -> str:
        """Return what a recording is called."""
        return self.names.get(path, path.name)


def read_series(
    path: Path, case: Case, automaton: Automaton, seen: Sequence[str]
) -> tuple[Series, ...]:
    """Return a recording of a case on its grid, a series for each window that is used of it.

    Raises SpecError, ValueError, ToolMissing.
    """
    used = [
        column.name
        for column in case.mapping.columns.values()
        if column.to in automaton.inputs or column.compare in seen
    ]
    recording = case.read.get(path)
    if recording is None or not recording.channels.keys() >= set(used):
        recording = case.opened[path] = read_recording(path, case.mapping, used)
    named = dataclasses.replace(recording, name=case.name_of(path))
    return pieces_of(named, case.mapping, automaton, seen)


def case_bench(
    case: Case, automaton: Automaton, series: Sequence[Series], seen: tuple[str, ...]
) -> Bench:
    """Return the bench of a case for some recordings as they were read."""
    effects = case.effects if case.effects is not None else shipped_effects()
    drifts = balance_drifts(case.document, automaton)
    bodies = [f"{one.name} {node_text(one.body)}" for one in effects]
    shelf = Shelf(case.stages, hash_of(node_text(case.document.root), bodies), case.before)
    return Bench(
        case.document, case.project, automaton, effects, tuple(series), seen, drifts, shelf
    )
