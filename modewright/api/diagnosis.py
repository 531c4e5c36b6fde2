"""Diagnosis: compare a spec with recordings, find missing effects and fit parameters."""

from __future__ import annotations

import dataclasses
import os
import shutil
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from diagnosis.criterion.threshold import (
    DEFAULT_THRESHOLDS,
    Thresholds,
    format_thresholds,
    read_thresholds,
)
from diagnosis.data.holdout import require_disjoint
from diagnosis.data.recording_names import recording_names
from diagnosis.data.sampled_recording import UnusableRecordingError
from diagnosis.data_quality.finding import format_findings
from diagnosis.data_quality.recording_check import used_columns
from diagnosis.model.effect_library import explain_unplaceable, library_effects, load_effects
from diagnosis.pipeline.diagnose import diagnose as run_diagnosis
from diagnosis.pipeline.diagnosis_case import Case, file_digests
from diagnosis.pipeline.parameter_fit import Fit, fit as fit_case
from diagnosis.pipeline.usable_recordings import LazyRecordings, select_usable
from diagnosis.report.diagnosis_report import (
    DiagnosisReport,
    undecided_verdict,
    unfollowed_signals,
    unusable_reasons,
    withdraw_nothing_missing,
)
from diagnosis.report.report_text import summary_lines
from diagnosis.report.stale_files import find_stale_files
from diagnosis.report.variant_file import format_variant, missing_effect_notes
from engine.recordings.recording import read_recording
from engine.recordings.recording_window import strip_window_suffix
from language.loading.load import automaton_of
from language.model.automaton import Automaton
from language.overlays.effect_reader import Effect
from language.overlays.expand_document import Project, display_path, expand_document, read_document
from language.text.arguments import (
    PathText,
    PathTexts,
    optional,
    require_instance,
    to_non_negative,
    to_path,
    to_project,
    to_some_texts,
    to_text,
    to_texts,
)
from language.text.diagnostic import Problems
from modewright.api.recordings import CheckedRecordings, check_recordings, held_out_findings
from modewright.runtime.blas_threads import SingleThreadedBlas
from modewright.runtime.gc_threshold import infrequent_gc
from modewright.runtime.output_files import OutputError, make_folder, remove_files, write_files

Report = Callable[[str], None]
"""A function that is called with each line of progress."""
CHECKPOINT_FOLDER = "stages"
"""The folder of checkpoints in a folder of results; an interrupted diagnosis continues from it."""
USUAL = "usual"
"""The word for the default thresholds; other texts are files."""


class BudgetSpent(Exception):
    """The time budget of a diagnosis passed before it reached a verdict."""


class UnusableRecordings(Exception):
    """No model can be fitted to the recordings, so that no result can be derived.

    `can_be_used_anyway` tells whether the option `anyway` would use them nevertheless.
    """

    def __init__(self, text: str, can_be_used_anyway: bool = False) -> None:
        super().__init__(text)
        self.can_be_used_anyway = can_be_used_anyway


class _Budget:
    """The time budget [s] of a diagnosis and the lines that it reported."""

    def __init__(self, seconds: float | None, report: Report) -> None:
        self.begun = time.monotonic()
        self.seconds = seconds
        self._report_line = report
        self.lines: list[str] = []

    def report(self, text: str) -> None:
        """Store a line and pass it on."""
        self.lines.append(text)
        self._report_line(text)

    def check(self) -> None:
        """Raise BudgetSpent if the time has passed."""
        if self.seconds is not None and self.elapsed > self.seconds:
            raise BudgetSpent(f"the {self.seconds:g} s of its budget are over")

    @property
    def elapsed(self) -> float:
        """The time [s] since the start of the diagnosis."""
        return time.monotonic() - self.begun


@SingleThreadedBlas()
@infrequent_gc()
def diagnose(
    spec: PathText,
    train: PathTexts,
    held_out: PathTexts = (),
    map: PathText | None = None,
    effects: PathText | None = None,
    root: PathText | None = None,
    *,
    thresholds: PathText = USUAL,
    out: PathText | None = None,
    budget: float | None = None,
    anyway: bool = False,
    tell: Report = lambda text: None,
) -> DiagnosisReport:
    """Find the effects that an automaton lacks to reproduce recordings.

    `train` are the recordings to explain, `held_out` those for the validation only; a recording
    that is named twice or in both raises ValueError, and so does an empty `train`. `map` is the map
    of recordings (default: that of the spec). `effects` is a folder of effects instead of those of
    the project and of the library. `thresholds` are `usual` (the defaults) or a file.

    Recordings with errors are left out, unless `anyway`; if none remains, or after `budget` seconds
    without a verdict, the verdict is `unknown`. With `out` the results are written there as by
    `save_diagnosis`, and an interrupted diagnosis continues from its checkpoints. `tell` is called
    with lines of progress. Raises SpecError, ValueError, MissingToolError and OutputError.
    """
    spec, project = to_text(spec, "spec"), to_project(root)
    files, held_out_files = to_some_texts(train, "train"), to_texts(held_out, "held_out")
    folder, effect_folder = optional(to_path, out, "out"), optional(to_path, effects, "effects")
    time_budget = _Budget(optional(to_non_negative, budget, "budget"), tell)
    tell = time_budget.report
    map_name, threshold_text = optional(to_text, map, "map"), to_text(thresholds, "thresholds")
    if not all(held_out_files):
        raise ValueError("`held_out` has an empty name: leave it out to hold out nothing")
    require_disjoint(files, held_out_files)
    limits = _read_thresholds(threshold_text)
    checked = check_recordings(files, map_name, spec, root=root)
    case, automaton = _build_case(spec, files, held_out_files, checked, effect_folder, project)
    stages = _checkpoint_folder(folder)
    case = dataclasses.replace(
        case,
        thresholds=limits,
        checkpoint_folder=stages,
        before_fit=time_budget.check,
    )
    tell(f"looked at {len(case.train)} recordings: {len(checked.check.findings)} findings")
    usable_files, errors = select_usable(case, checked.check, anyway)
    left_out = tuple(case.name_of(file) for file in case.train if file not in usable_files)
    if usable_files:
        reasons = [f"left out: {text}" for text in errors]
        if effect_folder is not None:
            reasons += explain_unplaceable(case.effects or (), case.document, case.project)
        for text in reasons:
            tell(text)
        case = dataclasses.replace(case, train=usable_files)
        report = _conclude(case, automaton, checked, left_out, reasons, time_budget)
    else:
        report = _report_unusable(case, automaton, checked, errors, time_budget)
    if folder is not None:
        save_diagnosis(report, folder, spec)
    return report


def _report_unusable(
    case: Case,
    automaton: Automaton,
    checked: CheckedRecordings,
    errors: Sequence[str],
    budget: _Budget,
) -> DiagnosisReport:
    """Return the report `unknown` for a diagnosis without usable recordings."""
    messages = tuple(dict.fromkeys((*unusable_reasons(checked.check), *errors)))
    verdict = undecided_verdict(messages, file_digests(case, case.train), budget.elapsed)
    return DiagnosisReport(case, automaton, checked.check, verdict)


def _checkpoint_folder(out: Path | None) -> Path | None:
    """Return the folder of checkpoints; None without `out`. Raises OutputError if it is a file."""
    if out is None:
        return None
    folder = out / CHECKPOINT_FOLDER
    if os.path.lexists(folder) and not folder.is_dir():
        raise OutputError(f"{folder}: this is a file; the folder of checkpoints has this name")
    return folder


def _conclude(
    case: Case,
    automaton: Automaton,
    checked: CheckedRecordings,
    left_out: tuple[str, ...],
    reasons: Sequence[str],
    budget: _Budget,
) -> DiagnosisReport:
    """Return the report of a diagnosis; the verdict is `unknown` if the budget is spent.

    A verdict from a part of the candidates would be misleading; the lines report what was found.
    """
    try:
        diagnosis = run_diagnosis(case, budget.report)
    except BudgetSpent as spent:
        done = [text for text in budget.lines if text.startswith(("accepted", "base fitted"))]
        advice = "with a larger --budget and the same --out it goes on from there"
        messages = (*reasons, f"not finished: {spent}", *done, advice)
        verdict = undecided_verdict(messages, file_digests(case, case.train), budget.elapsed)
        ended = f"{spent}; {advice}"
        return DiagnosisReport(
            case, automaton, checked.check, verdict, unused_recordings=left_out, end_reason=ended
        )
    except UnusableRecordingError as error:
        budget.report(f"not usable: {error}")
        return _report_unusable(case, automaton, checked, (*reasons, str(error)), budget)
    case = dataclasses.replace(case, thresholds=diagnosis.thresholds)
    after = file_digests(case, case.held_out)
    unfollowed = tuple(unfollowed_signals(diagnosis.verdict))
    verdict = withdraw_nothing_missing(diagnosis.verdict, unfollowed)
    dossier = DiagnosisReport(case, automaton, checked.check, verdict, diagnosis, after, left_out)
    warnings = (*unfollowed, *held_out_findings(case, automaton))
    for text in warnings:
        budget.report(text)
    messages = (
        *reasons,
        *summary_lines(dossier),
        *diagnosis.unread,
        *warnings,
        *missing_effect_notes(dossier),
    )
    verdict = dataclasses.replace(verdict, messages=messages)
    return dataclasses.replace(dossier, verdict=verdict)


def save_diagnosis(report: DiagnosisReport, out: PathText, spec: PathText) -> list[Path]:
    """Write verdict, variant, report and figures into a folder and return the paths.

    The folder is created if necessary; `thresholds.json` is written unless the thresholds are the
    defaults. Files of earlier diagnoses that are not written again are removed, except recordings
    and effects that the diagnosis read. Checkpoints are removed unless the diagnosis was ended
    early. `spec` is the name or path of the base. Raises OutputError.
    """
    from diagnosis.report.report_files import report_files

    folder, base = to_path(out, "out"), to_text(spec, "spec")
    require_instance(report, DiagnosisReport, "report")
    make_folder(folder)
    variant = format_variant(report, base_reference(report, base, folder))
    files = {}
    if report.case.thresholds != DEFAULT_THRESHOLDS:
        files[folder / "thresholds.json"] = format_thresholds(report.case.thresholds).encode()
    for name, data in report_files(report, variant, Path(display_path(folder))).items():
        files[folder / name] = data
    stale = [
        path
        for path in find_stale_files(folder)
        if path not in files and not _is_input_file(path, report)
    ]
    write_files(files)
    remove_files(stale)
    if not report.end_reason:
        shutil.rmtree(folder / CHECKPOINT_FOLDER, ignore_errors=True)
    return list(files)


def _is_input_file(path: Path, report: DiagnosisReport) -> bool:
    """Return whether a path is a recording or an effect that the diagnosis read."""
    recordings = (*report.case.train, *report.case.held_out)
    is_recording = path.resolve() in {strip_window_suffix(one).resolve() for one in recordings}
    return is_recording or path.stem in {effect.name for effect in report.case.effects or ()}


def base_reference(report: DiagnosisReport, spec: str, folder: Path) -> str:
    """Return the text by which a variant in `folder` refers to its base `spec`.

    This is the name of the base if exactly one file of the project has it, else the path of the
    base relative to `folder`.
    """
    project = report.case.project
    path = project.path_of(spec)
    if [file.resolve() for file in project.index.get(report.name, [])] == [path.resolve()]:
        return report.name
    return os.path.relpath(path.resolve(), folder.resolve())


def _build_case(
    spec: str,
    train: Sequence[str],
    held_out: Sequence[str],
    checked: CheckedRecordings,
    effects: Path | None,
    project: Project,
) -> tuple[Case, Automaton]:
    """Return the case of a diagnosis and its automaton.

    Raises SpecError for a sampled automaton, which has no equations that recordings could refute.
    """
    document = read_document(project.path_of(spec))
    automaton = checked.automaton or automaton_of(document, project)
    _require_continuous(automaton)
    expanded_document = expand_document(document, project)
    files = tuple(Path(file) for file in train), tuple(Path(file) for file in held_out)
    candidates = _load_effects(effects, project)
    names = recording_names(*files)
    known = dict(zip(files[0], checked.recordings, strict=True))
    used = used_columns(checked.mapping, automaton)
    read = LazyRecordings(known, files[1], lambda path: read_recording(path, checked.mapping, used))
    case = Case(
        expanded_document,
        project,
        checked.mapping,
        *files,
        candidates,
        names=names,
        recordings=read,
    )
    return case, automaton


def _require_continuous(automaton: Automaton) -> None:
    """Raise SpecError, at the place of the spec, for a sampled automaton."""
    problems = Problems()
    if automaton.is_sampled:
        label = f"`{automaton.name}` is sampled: it has a period"
        hint = "only a continuous automaton, the model of a machine, is compared with recordings"
        problems.error("form", automaton.span, label, hint)
    problems.raise_if_errors()


def _read_thresholds(thresholds: str) -> Thresholds:
    """Return the default thresholds, or those of a file. Raises ValueError."""
    if thresholds == USUAL:
        return DEFAULT_THRESHOLDS
    if not Path(thresholds).is_file():
        raise ValueError(f"thresholds `{thresholds}`: neither `{USUAL}` nor a file")
    return read_thresholds(Path(thresholds))


def _load_effects(folder: Path | None, project: Project) -> tuple[Effect, ...]:
    """Return the effects of a folder; without a folder those of the project and of the library.

    Raises SpecError and ValueError.
    """
    return library_effects(project) if folder is None else load_effects(folder)


@SingleThreadedBlas()
def fit(
    spec: PathText,
    train: PathTexts,
    parameters: PathTexts | None = None,
    map: PathText | None = None,
    root: PathText | None = None,
    *,
    anyway: bool = False,
    tell: Report = lambda text: None,
) -> Fit:
    """Fit parameters of an automaton within their ranges to recordings.

    `parameters` are the names to fit; None means all with a range. `map` defaults to the map of the
    spec. Recordings with errors are left out, unless `anyway`. `tell` is called with warnings and
    errors of recordings, with those left out, and with progress. Writes no file. Raises
    UnusableRecordings if no recording remains or the model diverges on one, SpecError,
    MissingToolError, and ValueError, also for an empty `train` or `parameters`.
    """
    spec, project, files = to_text(spec, "spec"), to_project(root), to_some_texts(train, "train")
    names = optional(to_some_texts, parameters, "parameters")
    map_name = optional(to_text, map, "map")
    require_disjoint(files, ())
    checked = check_recordings(files, map_name, spec, root=root)
    case, _ = _build_case(spec, files, (), checked, None, project)
    usable_files, errors = select_usable(case, checked.check, anyway)
    findings = [f"{severity}: {text}" for severity, text in format_findings(checked.check.findings)]
    for text in dict.fromkeys((*findings, *(f"error: {text}" for text in errors))):
        if not text.startswith("note"):
            tell(text)
    if not usable_files:
        text = "the recordings are not usable; nothing was fitted to them"
        raise UnusableRecordings(text, can_be_used_anyway=not anyway)
    for file in case.train:
        if file not in usable_files:
            tell(f"left out: {case.name_of(file)}")
    case = dataclasses.replace(case, train=usable_files)
    try:
        return fit_case(case, names, tell)
    except UnusableRecordingError as error:
        raise UnusableRecordings(f"{error}; nothing was fitted") from None
