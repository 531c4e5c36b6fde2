"""Recordings: files checked before anything is concluded from them."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.case import Case
from diagnosis.file_names import file_names
from diagnosis.finding import told
from diagnosis.guessed_map import guessed_map
from diagnosis.mistakes import mistakes_of
from diagnosis.recording_check import RecordingCheck, check_recordings as checked, used_columns
from engine.recording import Recording, read_recording
from language.experiment import RecordingMap
from language.load import automaton_of
from language.map import read_map
from language.missing import ToolMissing
from language.model import Automaton
from language.pairing import check_pairing
from language.problem import Problems, SpecError
from language.project import Project, expanded, read_document
from modewright.compiled import carried_out

if TYPE_CHECKING:
    from engine.plot import Picture


Lacking = dict[str, str]
"""Why a file has none of some columns, by their names in the map."""
LACKING = ("column", "empty")
"""Problems of a file that lacks a column, or has no value in it."""


@dataclass(frozen=True)
class CheckedRecordings:
    """Recordings with what was found of them, and the automaton of a spec."""

    check: RecordingCheck
    mapping: RecordingMap
    recordings: tuple[Recording, ...] = field(repr=False)
    automaton: Automaton | None = field(default=None, repr=False)

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
        _check_map(automaton, mapping)
    else:
        mapping = guessed_map(Path(files[0]), databases)
    used = used_columns(mapping, automaton)
    if len({os.path.realpath(file) for file in files}) < len(files):
        raise ValueError("a recording is named twice: each recording counts once")
    names = file_names([Path(file) for file in files])
    read = [_read(path, name, mapping, used) for path, name in names.items()]
    recordings = tuple(recording for recording, _ in read)
    lacking = {recording.name: why for recording, why in read}
    if spec is None or automaton is None:
        check = _explained(checked(recordings, mapping, automaton), lacking)
        return CheckedRecordings(check, mapping, recordings)
    document = expanded(read_document(project.path_of(spec)), project)
    mistakes = partial(mistakes_of, document, project, automaton, mapping)
    check = _explained(checked(recordings, mapping, automaton, carried_out, mistakes), lacking)
    return CheckedRecordings(check, mapping, recordings, automaton)


def held_out_findings(case: Case, automaton: Automaton) -> tuple[str, ...]:
    """Return what a check finds of recordings that are held out, for people.

    It is told beside a verdict that is final. What cannot be used is told elsewhere.
    """
    used = used_columns(case.mapping, automaton)
    recordings = []
    for path in case.held_out:
        name = case.name_of(path)
        with suppress(SpecError, ToolMissing, ValueError):
            known = case.read.get(path) or _read(path, name, case.mapping, used)[0]
            recordings.append(dataclasses.replace(known, name=name))
    if not recordings:
        return ()
    mistakes = partial(mistakes_of, case.document, case.project, automaton, case.mapping)
    check = checked(recordings, case.mapping, automaton, carried_out, mistakes)
    serious = [finding for finding in check.findings if finding.severity != "note"]
    return tuple(f"held out, {severity}: {text}" for severity, text in told(serious))


def _read(
    path: Path, name: str, mapping: RecordingMap, used: Sequence[str]
) -> tuple[Recording, Lacking]:
    """Read a recording, without the columns that it has not got; say why it has not.

    What else is wrong with a file is a problem of the file. Raises SpecError, ToolMissing.
    """
    why: Lacking = {}
    try:
        recording = read_recording(path, mapping, used)
    except SpecError as error:
        why = {column: text for column in used if (text := _lack(path, mapping, column))}
        kept = [column for column in used if column not in why]
        if not kept or any(problem.kind not in LACKING for problem in error.problems):
            raise
        recording = read_recording(path, mapping, kept)
    return dataclasses.replace(recording, name=name), why


def _lack(path: Path, mapping: RecordingMap, column: str) -> str:
    """Return why a file does not have a column; empty where it has, or is wrong otherwise."""
    try:
        read_recording(path, mapping, [column])
    except SpecError as error:
        lacks = [problem for problem in error.problems if problem.kind in LACKING]
        if len(lacks) == len(error.problems):
            return "; ".join(text for text in (lacks[0].label, lacks[0].help) if text)
    return ""


def _explained(check: RecordingCheck, lacking: Mapping[str, Lacking]) -> RecordingCheck:
    """Return a check in which missing signals are told with why they are."""
    findings = []
    for one in check.findings:
        why = lacking.get(one.recording, {}).get(one.channel, "")
        is_absent = bool(why) and one.kind == "no_signal"
        findings.append(dataclasses.replace(one, text=why) if is_absent else one)
    return dataclasses.replace(check, findings=tuple(findings))


def _check_map(automaton: Automaton | None, mapping: RecordingMap) -> None:
    """Raise SpecError where a map is not one for an automaton."""
    problems = Problems()
    if automaton is not None:
        check_pairing(automaton, mapping, problems)
    problems.stop_if_any()


def _automaton(spec: str, project: Project) -> Automaton:
    return automaton_of(read_document(project.path_of(spec)), project)
