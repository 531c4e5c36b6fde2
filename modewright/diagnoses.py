"""Diagnoses: recordings against a spec, as functions of the public API."""

from __future__ import annotations

import dataclasses
import os
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from diagnosis.case import Bootstrap, Case
from diagnosis.diagnose import diagnose as diagnosed
from diagnosis.dossier import Dossier, hashes, undecided, unusable
from diagnosis.file_names import names_of
from diagnosis.finding import told
from diagnosis.fit import Fit, fit as fitted
from diagnosis.leftover import left_by
from diagnosis.library import library
from diagnosis.recording_check import used_columns
from diagnosis.threshold import EVERYWHERE, Thresholds, thresholds_in, written
from diagnosis.variant import needed, variant_text
from diagnosis.wording import summary
from engine.recorded_part import file_of
from engine.recording import read_recording
from language.effect import Effect
from language.load import automaton_of
from language.model import Automaton
from language.project import Project, expanded, read_document, shown
from modewright.apart import require_apart
from modewright.files import OutputError, make_folder, remove_files, write_files
from modewright.garbage import rarely_looked
from modewright.missed import missed, with_missed
from modewright.own_effects import laid_nowhere, own_effects
from modewright.recordings import CheckedRecordings, check_recordings, held_out_findings
from modewright.threads import OneThread
from modewright.workable import OpenedLater, workable

Tell = Callable[[str], None]
KEPT = "kept"
STAGES = "stages"
"""Where a folder of results keeps what a diagnosis that was ended goes on from."""
BOOTSTRAPS: Mapping[str, Bootstrap] = {KEPT: "kept", "bootstrap": "made", "usual": "never"}
"""Words for thresholds; anything else is a file."""


class BudgetSpent(Exception):
    """The time that a diagnosis may take has passed before it came to a verdict."""


class UnusableRecordings(Exception):
    """Recordings have errors that make whatever follows from them worthless."""


class _Budget:
    """The time [s] that a diagnosis may take, and what has been told in it."""

    def __init__(self, seconds: float | None, tell: Tell) -> None:
        self.begun = time.monotonic()
        self.seconds = seconds
        self.telling = tell
        self.told: list[str] = []

    def tell(self, text: str) -> None:
        """Tell what a stage has found."""
        self.told.append(text)
        self.telling(text)

    def check(self) -> None:
        """Raise BudgetSpent when the time has passed."""
        if self.seconds is not None and self.spent > self.seconds:
            raise BudgetSpent(f"the {self.seconds:g} s of its budget are over")

    @property
    def spent(self) -> float:
        """The time [s] since the beginning."""
        return time.monotonic() - self.begun


@OneThread()
@rarely_looked()
def diagnose(
    spec: str,
    train: Sequence[str | Path],
    held_out: Sequence[str | Path] = (),
    map: str | None = None,
    effects: str | Path | None = None,
    root: Path | None = None,
    *,
    thresholds: str | Path = KEPT,
    out: str | Path | None = None,
    budget: float | None = None,
    anyway: bool = False,
    tell: Tell = lambda text: None,
) -> Dossier:
    """Say which physics an automaton lacks to show what was recorded; write it into a folder.

    Recordings with faults that make a verdict worthless give the verdict `unknown`, unless it is
    wanted `anyway`. `effects` is a folder of effects in place of those shipped, `budget` a time
    [s] after which the verdict is `unknown` if none was found. `thresholds` are those that a
    bootstrap has left (`kept`, else the usual one), those of a `bootstrap` made where it has left
    none, the `usual` one, or a file. Raises SpecError, ValueError, ToolMissing, OutputError.
    """
    clock = _Budget(budget, tell)
    tell = clock.tell
    require_apart(train, held_out)
    bootstrap, limits = _wanted(thresholds)
    checked = check_recordings(train, map, spec, root=root)
    case, automaton = _case(spec, train, held_out, checked, effects, root)
    stages = _stages(out)
    case = dataclasses.replace(
        case, thresholds=limits, bootstrap=bootstrap, stages=stages, before=clock.check
    )
    tell(f"looked at {len(case.train)} recordings: {len(checked.check.findings)} findings")
    kept, errors = workable(case, checked.check, anyway)
    left_out = tuple(case.name_of(file) for file in case.train if file not in kept)
    if kept:
        reasons = [f"left out: {text}" for text in errors]
        if effects is not None:
            reasons += laid_nowhere(case.effects or (), case.document, case.project)
        for text in reasons:
            tell(text)
        case = dataclasses.replace(case, train=kept)
        dossier = _concluded(case, automaton, checked, left_out, reasons, clock)
    else:
        dossier = _unusable(case, automaton, checked, errors, clock)
    if out is not None:
        save_diagnosis(dossier, out, spec)
    return dossier


def _unusable(
    case: Case,
    automaton: Automaton,
    checked: CheckedRecordings,
    errors: Sequence[str],
    clock: _Budget,
) -> Dossier:
    """Return what is told where no recording is left to conclude from."""
    messages = tuple(dict.fromkeys((*unusable(checked.check), *errors)))
    verdict = undecided(messages, hashes(case, case.train), clock.spent)
    return Dossier(case, automaton, checked.check, verdict)


def _stages(out: str | Path | None) -> Path | None:
    """Return where stages are kept. Raises OutputError where they cannot be."""
    if out is None:
        return None
    stages = Path(out) / STAGES
    if os.path.lexists(stages) and not stages.is_dir():
        raise OutputError(f"{stages}: this is a file; what is found on the way is kept there")
    return stages


def _concluded(
    case: Case,
    automaton: Automaton,
    checked: CheckedRecordings,
    left_out: tuple[str, ...],
    reasons: Sequence[str],
    clock: _Budget,
) -> Dossier:
    """Return what is concluded from recordings; where the time is over, what was found till then.

    A verdict from a part of the candidates would look like one from all: it is `unknown`.
    """
    try:
        found = diagnosed(case, clock.tell)
    except BudgetSpent as spent:
        done = [text for text in clock.told if text.startswith(("accepted", "recalibrated"))]
        advice = "with a larger --budget and the same --out it goes on from there"
        messages = (*reasons, f"not finished: {spent}", *done, advice)
        verdict = undecided(messages, hashes(case, case.train), clock.spent)
        ended = f"{spent}; {advice}"
        return Dossier(case, automaton, checked.check, verdict, left_out=left_out, ended=ended)
    case = dataclasses.replace(case, thresholds=found.thresholds)
    after = hashes(case, case.held_out)
    misses = tuple(missed(found.verdict))
    verdict = with_missed(found.verdict, misses)
    dossier = Dossier(case, automaton, checked.check, verdict, found, after, left_out)
    doubts = (*misses, *held_out_findings(case, automaton))
    for text in doubts:
        clock.tell(text)
    messages = (*reasons, *summary(dossier), *found.unread, *doubts, *needed(dossier))
    verdict = dataclasses.replace(verdict, messages=messages)
    return dataclasses.replace(dossier, verdict=verdict)


def save_diagnosis(dossier: Dossier, out: str | Path, spec: str) -> list[Path]:
    """Write verdict, variant, report and figures into a folder; return the files.

    Raises OutputError.
    """
    from diagnosis.report import report_files

    folder = Path(out)
    make_folder(folder)
    variant = variant_text(dossier, base_of(dossier, spec, folder))
    files = {}
    if dossier.case.thresholds != EVERYWHERE:
        files[folder / "thresholds.json"] = written(dossier.case.thresholds).encode()
    for name, data in report_files(dossier, variant, Path(shown(folder))).items():
        files[folder / name] = data
    stale = [path for path in left_by(folder) if path not in files and not _is_read(path, dossier)]
    write_files(files)
    remove_files(stale)
    if not dossier.ended:
        shutil.rmtree(folder / STAGES, ignore_errors=True)
    return list(files)


def _is_read(path: Path, dossier: Dossier) -> bool:
    """Tell whether a file is one that the diagnosis itself has read."""
    recordings = (*dossier.case.train, *dossier.case.held_out)
    is_recording = path.resolve() in {file_of(one).resolve() for one in recordings}
    return is_recording or path.stem in {effect.name for effect in dossier.case.effects or ()}


def base_of(dossier: Dossier, spec: str, folder: Path) -> str:
    """Return how a variant in a folder names its base: by name, or by file if need be."""
    project = dossier.case.project
    path = project.path_of(spec)
    if [file.resolve() for file in project.index.get(dossier.name, [])] == [path.resolve()]:
        return dossier.name
    return os.path.relpath(path.resolve(), folder.resolve())


def _case(
    spec: str,
    train: Sequence[str | Path],
    held_out: Sequence[str | Path],
    checked: CheckedRecordings,
    effects: str | Path | None,
    root: Path | None,
) -> tuple[Case, Automaton]:
    project = Project(root or Path())
    document = read_document(project.path_of(spec))
    automaton = checked.automaton or automaton_of(document, project)
    whole = expanded(document, project)
    files = tuple(Path(file) for file in train), tuple(Path(file) for file in held_out)
    candidates = _candidates(effects, project)
    names = names_of(*files)
    known = dict(zip(files[0], checked.recordings, strict=True))
    used = used_columns(checked.mapping, automaton)
    read = OpenedLater(known, files[1], lambda path: read_recording(path, checked.mapping, used))
    case = Case(whole, project, checked.mapping, *files, candidates, names=names, read=read)
    return case, automaton


def _wanted(thresholds: str | Path) -> tuple[Bootstrap, Thresholds]:
    """Return whether a bootstrap is used, and the thresholds without one. Raises ValueError."""
    if thresholds in BOOTSTRAPS:
        return BOOTSTRAPS[str(thresholds)], EVERYWHERE
    if not Path(thresholds).is_file():
        words = ", ".join(BOOTSTRAPS)
        raise ValueError(f"thresholds `{thresholds}`: neither one of {words} nor a file")
    return "never", thresholds_in(Path(thresholds))


def _candidates(folder: str | Path | None, project: Project) -> tuple[Effect, ...]:
    """Return the effects of a folder; without one those of the project and those shipped.

    Raises SpecError, ValueError.
    """
    return library(project) if folder is None else own_effects(Path(folder))


@OneThread()
def fit(
    spec: str,
    train: Sequence[str | Path],
    parameters: Sequence[str] | None = None,
    map: str | None = None,
    root: Path | None = None,
    *,
    anyway: bool = False,
    tell: Tell = lambda text: None,
) -> Fit:
    """Fit parameters of an automaton within their ranges to what was recorded.

    `parameters` are those that may move: all that have a range, if none are named. What is odd
    about the recordings is told. Those with errors are not used, but if it is wanted `anyway`.
    Raises UnusableRecordings where most of them are, SpecError, ValueError, ToolMissing.
    """
    require_apart(train, ())
    checked = check_recordings(train, map, spec, root=root)
    case, _ = _case(spec, train, (), checked, None, root)
    kept, errors = workable(case, checked.check, anyway)
    found = [f"{severity}: {text}" for severity, text in told(checked.check.findings)]
    for text in dict.fromkeys((*found, *(f"error: {text}" for text in errors))):
        if not text.startswith("note"):
            tell(text)
    if not kept:
        raise UnusableRecordings("the recordings are not usable; nothing was fitted to them")
    for file in case.train:
        if file not in kept:
            tell(f"left out: {case.name_of(file)}")
    case = dataclasses.replace(case, train=kept)
    return fitted(case, parameters, tell)
