"""Recordings: read recordings and check their quality before an analysis."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.data.recording_names import distinguish_file_names
from diagnosis.data_quality.column_hypothesis import find_clock_and_sign_errors
from diagnosis.data_quality.finding import Finding, format_findings
from diagnosis.data_quality.recording_check import (
    RecordingCheck,
    check_recordings as run_checks,
    used_columns,
)
from diagnosis.data_quality.recording_map_inference import (
    guess_map,
    open_without_map,
    read_database_option,
    unmapped,
)
from diagnosis.data_quality.recording_map_proposal import propose_columns
from diagnosis.data_quality.recording_map_text import format_map, map_name
from diagnosis.pipeline.diagnosis_case import Case
from engine.recordings.recording import Recording, read_recording
from engine.recordings.recording_window import strip_window_suffix
from language.expressions.name_rules import NAME_PATTERN
from language.loading.load import automaton_of, load_automaton
from language.loading.recording_map_columns import check_pairing, type_columns
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.model.system import RecordingMap
from language.overlays.expand_document import (
    Project,
    display_path,
    expand_document,
    read_document,
)
from language.text.arguments import (
    PathText,
    PathTexts,
    optional,
    to_project,
    to_some_texts,
    to_text,
    to_texts,
)
from language.text.diagnostic import MissingToolError, Problems, Source, Span, SpecError
from language.text.sanitise import escape_invisible
from modewright.runtime.back_end_choice import simulate_resolved

if TYPE_CHECKING:
    from engine.results.plot import Picture


MissingReasons = dict[str, str]
"""Reasons why a file lacks columns, by column of the map."""
MISSING_KINDS = ("column", "empty")
"""Kinds of problems that mean a missing or empty column."""


@dataclass(frozen=True)
class CheckedRecordings:
    """Recordings with the result of their check, and the automaton of the spec."""

    check: RecordingCheck
    mapping: RecordingMap
    recordings: tuple[Recording, ...] = field(repr=False)
    automaton: Automaton | None = field(default=None, repr=False)

    def plot(self, title: str = "") -> Picture:
        """Return a figure of the channels of all recordings with their excitation and findings.

        An empty title is replaced by the names of the recordings, separated by `, `.
        """
        from diagnosis.data_quality.recording_figure import draw_recordings

        title = to_text(title, "title", "a text")
        names = ", ".join(recording.name for recording in self.recordings)
        return draw_recordings(self.recordings, self.check, title or names)


def check_recordings(
    files: PathTexts,
    map: PathText | None = None,
    spec: PathText | None = None,
    databases: PathTexts = (),
    root: PathText | None = None,
) -> CheckedRecordings:
    """Read recordings and check their rates, gaps, noise and excitation.

    With a spec units, signs and clocks are checked, too, and only the columns that it uses are
    read. `map` defaults to the map that the spec names. Without map and spec the columns of all
    files are guessed by name, with DBC files `databases`, and those left out are findings.
    Findings, also missing columns, are returned and not raised. Raises SpecError for unreadable
    files, for a spec without map and for a map that does not fit; MissingToolError; and ValueError
    without a file and if a file occurs twice.
    """
    project, paths = to_project(root), [Path(file) for file in to_some_texts(files, "files")]
    map_name, spec = optional(to_text, map, "map"), optional(to_text, spec, "spec")
    database_files = to_texts(databases, "databases")
    automaton = load_automaton(spec, project) if spec else None
    map_name = map_name or (
        automaton.recording_map.text if automaton and automaton.recording_map else None
    )
    if automaton and not map_name:
        problems = Problems()
        label = f"`{automaton.name}` names no map of recordings"
        hint = "`recording_map: <name>` in the spec, or `--map`"
        problems.error("missing", automaton.span, label, hint)
        raise SpecError(problems.reported)
    mapping = read_map(read_document(project.path_of(map_name)), project) if map_name else None
    if mapping is not None:
        _check_map(automaton, mapping)
        mapping = type_columns(automaton, mapping) if automaton else mapping
    if len({os.path.realpath(path) for path in paths}) < len(paths):
        raise ValueError("a recording is named twice: each recording counts once")
    names = distinguish_file_names(paths)
    file_findings: tuple[Finding, ...] = ()
    if mapping is None:
        mapping, file_findings = guess_map(names, database_files)
    used = used_columns(mapping, automaton)
    read = [_read_available(path, name, mapping, used) for path, name in names.items()]
    recordings = tuple(recording for recording, _ in read)
    reasons = {recording.name: why for recording, why in read}
    if spec is None or automaton is None:
        check = run_checks(recordings, mapping, automaton, file_findings=file_findings)
        check = _add_missing_reasons(check, reasons)
        return CheckedRecordings(check, mapping, recordings)
    document = expand_document(read_document(project.path_of(spec)), project)
    mistakes = partial(find_clock_and_sign_errors, document, project, automaton, mapping)
    check = _add_missing_reasons(
        run_checks(recordings, mapping, automaton, simulate_resolved, mistakes), reasons
    )
    return CheckedRecordings(check, mapping, recordings, automaton)


def propose_map(
    file: PathText,
    spec: PathText,
    databases: PathTexts = (),
    name: PathText | None = None,
    root: PathText | None = None,
) -> str:
    """Return the YAML text of a map from the columns of a file to the signals of an automaton.

    The columns, units and scales follow from names, units, values and the model
    (`propose_columns`); comments tell the reasons and what is open. `databases` are the DBC files
    of a CAN log; the map names them as they are given here. Raises SpecError for a file or a spec
    that cannot be read, for a file without a time column and for one of whose columns none fits;
    MissingToolError; and ValueError for a name that no map can have.
    """
    project, path = to_project(root), Path(to_text(file, "file"))
    automaton, own_map = _without_map(to_text(spec, "spec"), project)
    named = to_texts(databases, "databases")
    title = optional(to_text, name, "name") or own_map
    if title and not NAME_PATTERN.fullmatch(title):
        raise ValueError(f"`{title}` is not a name of a map")
    place = Span(Source(display_path(path)), 1, 1)
    found = tuple(map(read_database_option, named))
    if len({bool(one.bus) for one in found}) > 1:
        raise ValueError("either each database has a bus (`can0=a.dbc`) or none has one")
    problems = Problems()
    empty = unmapped("proposed", place, found)
    recorded, time, unit, _ = open_without_map(path, empty, problems)
    proposal = propose_columns(recorded, automaton, time)
    if not proposal.columns:
        label = f"no column fits an input or output of `{automaton.name}`"
        names = ", ".join((*automaton.inputs, *automaton.outputs))
        help = recorded.explain_missing("") or f"its signals are {names}"
        problems.error("empty", recorded.header_span, label, help)
    problems.raise_if_errors()
    stem = Path(strip_window_suffix(path).name.removesuffix(".gz")).stem
    about = f"proposed for {automaton.name} from the columns of {path.name}; check each line"
    title = title or map_name(stem)
    return format_map(title, escape_invisible(about), (time, unit), proposal, found)


def _without_map(spec: str, project: Project) -> tuple[Automaton, str]:
    """Return an automaton without its recording map, and the name of a map that does not exist.

    The name is empty if the spec names no map or an existing one. Raises SpecError.
    """
    document = expand_document(project.read(project.path_of(spec)), project)
    entries = dict(document.root.entries)
    entry = entries.pop("recording_map", None)
    root = dataclasses.replace(document.root, entries=entries)
    automaton = automaton_of(dataclasses.replace(document, root=root), project)
    name = document.root.text_of("recording_map") if entry else ""
    try:
        project.path_of(name) if name else None
    except SpecError:
        return automaton, name
    return automaton, ""


def held_out_findings(case: Case, automaton: Automaton) -> tuple[str, ...]:
    """Return the warnings and errors of held-out recordings as lines `held out, severity: text`.

    Notes are omitted. The findings do not influence the verdict. Recordings that cannot be read are
    skipped; empty if none remains.
    """
    used = used_columns(case.mapping, automaton)
    recordings = []
    for path in case.held_out:
        name = case.name_of(path)
        with suppress(SpecError, MissingToolError, ValueError):
            recording = (
                case.recordings.get(path) or _read_available(path, name, case.mapping, used)[0]
            )
            recordings.append(dataclasses.replace(recording, name=name))
    if not recordings:
        return ()
    mistakes = partial(
        find_clock_and_sign_errors, case.document, case.project, automaton, case.mapping
    )
    check = run_checks(recordings, case.mapping, automaton, simulate_resolved, mistakes)
    serious = [finding for finding in check.findings if finding.severity != "note"]
    return tuple(f"held out, {severity}: {text}" for severity, text in format_findings(serious))


def _read_available(
    path: Path, name: str, mapping: RecordingMap, columns: Sequence[str]
) -> tuple[Recording, MissingReasons]:
    """Read the columns that a file has; return the recording and the reasons for missing ones.

    Raises SpecError for other problems of the file, and MissingToolError.
    """
    reasons: MissingReasons = {}
    try:
        recording = read_recording(path, mapping, columns)
    except SpecError as error:
        reasons = {
            column: text for column in columns if (text := _missing_reason(path, mapping, column))
        }
        available = [column for column in columns if column not in reasons]
        if not available or any(problem.kind not in MISSING_KINDS for problem in error.problems):
            raise
        recording = read_recording(path, mapping, available)
    return dataclasses.replace(recording, name=name), reasons


def _missing_reason(path: Path, mapping: RecordingMap, column: str) -> str:
    """Return the reason why a file lacks a column; empty if it has it or has another problem."""
    try:
        read_recording(path, mapping, [column])
    except SpecError as error:
        lacks = [problem for problem in error.problems if problem.kind in MISSING_KINDS]
        if len(lacks) == len(error.problems):
            return "; ".join(text for text in (lacks[0].label, lacks[0].help) if text)
    return ""


def _add_missing_reasons(
    check: RecordingCheck, reasons: Mapping[str, MissingReasons]
) -> RecordingCheck:
    """Return a check whose findings about missing signals contain the reason."""
    findings = []
    for finding in check.findings:
        why = reasons.get(finding.recording, {}).get(finding.channel, "")
        is_absent = bool(why) and finding.kind == "no_signal"
        findings.append(dataclasses.replace(finding, text=why) if is_absent else finding)
    return dataclasses.replace(check, findings=tuple(findings))


def _check_map(automaton: Automaton | None, mapping: RecordingMap) -> None:
    """Raise SpecError if a map does not fit an automaton."""
    problems = Problems()
    if automaton is not None:
        check_pairing(automaton, mapping, problems)
    problems.raise_if_errors()
