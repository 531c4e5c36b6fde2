"""Recordings: files checked before anything is concluded from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.guessed_map import guessed_map
from diagnosis.recording_check import RecordingCheck, check_recordings as checked
from engine.recording import Recording, read_recording
from language.experiment import RecordingMap
from language.load import automaton_of
from language.map import read_map
from language.model import Automaton
from language.problem import Problems, SpecError
from language.project import Project, read_document

if TYPE_CHECKING:
    from engine.plot import Picture


@dataclass(frozen=True)
class CheckedRecordings:
    """Recordings with what was found of them."""

    check: RecordingCheck
    mapping: RecordingMap
    recordings: tuple[Recording, ...] = field(repr=False)

    def plot(self, title: str = "") -> Picture:
        """Return a picture of the channels, what they excite and what was found."""
        from diagnosis.recording_picture import recording_picture

        names = ", ".join(recording.name for recording in self.recordings)
        return recording_picture(self.recordings, self.check, title or names)


def check_recordings(
    files: Sequence[str | Path],
    map: str | None = None,
    spec: str | None = None,
    databases: Sequence[str] = (),
    root: Path | None = None,
) -> CheckedRecordings:
    """Check recordings: rates, gaps, noise, what they excite; with a spec units, signs and clocks.

    Without a map that of the spec is taken; without either, columns are guessed by their names.
    Raises SpecError, ToolMissing.
    """
    project = Project(root or Path())
    automaton = _automaton(spec, project) if spec else None
    named = map or (automaton.recording_map.text if automaton and automaton.recording_map else None)
    if automaton and not named:
        problems = Problems()
        label = f"`{automaton.name}` names no map of recordings"
        hint = "`recording_map: <name>` in the spec, or `--map`"
        problems.error("missing", automaton.span, label, hint)
        raise SpecError(problems.found)
    if named:
        mapping = read_map(read_document(project.path_of(named)), project)
    else:
        mapping = guessed_map(Path(files[0]), databases)
    used = _used(mapping, automaton)
    recordings = tuple(read_recording(Path(file), mapping, used) for file in files)
    return CheckedRecordings(checked(recordings, mapping, automaton), mapping, recordings)


def _automaton(spec: str, project: Project) -> Automaton:
    return automaton_of(read_document(project.path_of(spec)), project)


def _used(mapping: RecordingMap, automaton: Automaton | None) -> list[str]:
    """Return the columns that an automaton reads or compares; all of them without one."""
    if automaton is None:
        return list(mapping.columns)
    return [
        column.name
        for column in mapping.columns.values()
        if column.to in automaton.inputs or column.compare in automaton.outputs
    ] or list(mapping.columns)
