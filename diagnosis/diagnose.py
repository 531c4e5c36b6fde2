"""Diagnose: recordings against a model - recalibrate, locate, name, model, show.

Selection knows the training recordings alone. What is held out is opened after that is final; it
can confirm the verdict or not, and change nothing else.
"""

from __future__ import annotations

import dataclasses
import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from diagnosis.alone import LEFT_OUT, SIMULATED, alone, forgets
from diagnosis.bench import Bench, balance_drifts
from diagnosis.bootstrap import bootstrapped, kept_thresholds
from diagnosis.description import Description, described
from diagnosis.doubt import explains_more, is_doubtful, selected_formula
from diagnosis.estimation import Estimate, adapted
from diagnosis.evidence import inflation
from diagnosis.hidden import with_hidden
from diagnosis.layers import shipped_effects
from diagnosis.level import units_of
from diagnosis.location import led_by, located
from diagnosis.locus import Locus
from diagnosis.naming import named, place_path, quantities_of, verdict_id
from diagnosis.place_sentence import place_sentence
from diagnosis.plan import Plan, planned
from diagnosis.recipe import node_text
from diagnosis.search import Tell, Tried
from diagnosis.selection import Selection, selected
from diagnosis.series import Series, compared, paced, pieces_of
from diagnosis.shelf import Shelf, hash_of
from diagnosis.shuffle import Shuffle, shuffle_of
from diagnosis.simulation import misfits
from diagnosis.starting import settled_at_start, started
from diagnosis.threshold import EVERYWHERE, USUAL, Thresholds
from diagnosis.verdict import Misfit, Named, Ranked, Says, Verdict
from diagnosis.ways import Way, better_way, chosen, ways_of
from engine.recorded_part import file_of
from engine.recording import read_recording
from language.document import Document
from language.effect import Effect
from language.experiment import RecordingMap
from language.load import automaton_of
from language.model import Automaton
from language.problem import SpecError
from language.project import Project

CLEAR = 3.0
"""A rival within this of the best [nats] makes the verdict ambiguous."""
UNKNOWN = 4.0
"""Times the threshold that a free drift must gain over the base where no effect was accepted."""

Bootstrap = Literal["never", "kept", "made"]
"""Whether thresholds of a bootstrap are used: never, where one has left them, always."""


@dataclass(frozen=True)
class Case:
    """What is diagnosed: an expanded automaton, a map, and recordings.

    `names` are those of files whose bare name is not theirs alone; in the folder `stages` it is
    kept what was found, so that a diagnosis that was ended goes on from there. `before` is called
    before each fit: it may raise what ends the diagnosis.
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
    stages: Path | None = None
    before: Callable[[], None] = lambda: None

    def name_of(self, path: Path) -> str:
        """Return what a recording is called."""
        return self.names.get(path, path.name)


@dataclass(frozen=True)
class Diagnosis:
    """A verdict with the models behind it; `bench` holds the training recordings.

    `description` is the formula that an unknown was turned into: it then is what was accepted.
    `plan` is what would tell an accepted effect from those that do nearly as well. `shuffles` is
    what follows the largest step: of the base, then of the model with what was accepted.
    """

    verdict: Verdict
    selection: Selection = field(repr=False)
    bench: Bench = field(repr=False)
    held_out: tuple[Series, ...] = field(repr=False)
    description: Description | None = field(default=None, repr=False)
    thresholds: Thresholds = EVERYWHERE
    plan: Plan | None = field(default=None, repr=False)
    shuffles: tuple[Shuffle, ...] = field(default=(), repr=False)
    unread: tuple[str, ...] = ()


def diagnose(case: Case, tell: Tell = lambda text: None) -> Diagnosis:
    """Return the diagnosis of a case. Raises SpecError, ValueError, ToolMissing."""
    begun = time.monotonic()
    automaton = automaton_of(case.document, case.project)
    seen = compared(case.mapping, automaton)
    if not seen:
        raise ValueError(f"map `{case.mapping.name}` compares no output of `{automaton.name}`")
    series = [one for path in case.train for one in read_series(path, case, automaton, seen)]
    raw = case_bench(case, automaton, series, seen)
    ways = ways_of(raw, tell)
    bench, base = better_way(ways)
    judge = _judged_alone if forgets(base, bench.series) else _judged
    judged = judge(case, raw, ways, tell)
    bench, selection, loci = judged.bench, judged.selection, judged.loci
    plan = planned(bench, _told_apart(selection, automaton))
    if plan is not None:
        tell(plan.sentence())
    loci = led_by(loci, [place_path(tried.layer) for tried in selection.accepted], bench)
    fit = {"train": misfits(judged.base, selection.model, bench.series)}
    verdict = _verdict(judged.says, selection, loci, automaton, fit)
    hashes = {case.name_of(path): _digest(path) for path in case.train}
    verdict = dataclasses.replace(verdict, inputs=hashes, messages=(place_sentence(loci, bench),))
    held, unread = _held_out(case, automaton, seen, bench.series[0].is_linear)
    if held:
        tell(
            "held out: "
            + ", ".join(f"{case.name_of(path)} {_digest(path)}" for path in case.held_out)
        )
        held = started(selection.base, [settled_at_start(one) for one in held])
        verdict = _confirmed(verdict, selection, held)
    verdict = dataclasses.replace(verdict, runtime_s=time.monotonic() - begun)
    shuffles = _shuffles(selection, bench)
    known = judged.description, judged.thresholds, plan, shuffles
    return Diagnosis(verdict, selection, bench, held, *known, unread=unread)


@dataclass(frozen=True)
class _Judged:
    """What selection has come to; `bench` has the recordings as they were judged."""

    bench: Bench
    base: Estimate
    selection: Selection
    loci: tuple[Locus, ...]
    says: Says
    thresholds: Thresholds
    description: Description | None = None


def _judged(case: Case, raw: Bench, ways: Sequence[Way], tell: Tell) -> _Judged:
    """Judge models by what an observer foresees from sample to sample."""
    thresholds = _thresholds(case, *better_way(ways), raw.series, tell)
    most = max(USUAL, thresholds.most)
    bench, base, selection = chosen(ways, thresholds, tell)
    units = units_of(base.candidate, bench.series, base.noises, base.values(0))
    loci = located(bench, base)
    tell(place_sentence(loci, bench))
    selection = with_hidden(bench, selection, loci, UNKNOWN * most, tell)
    says = _says(selection, loci, bench, most)
    formula = None
    if is_doubtful(says, selection, loci, bench, most):
        formula = described(bench, selection.base, loci, units, most, tell)
    if formula is not None and explains_more(formula, selection):
        says, selection = "unknown", selected_formula(selection, formula)
    else:
        formula = None
    return _Judged(bench, base, selection, loci, says, thresholds, formula)


def _judged_alone(case: Case, raw: Bench, ways: Sequence[Way], tell: Tell) -> _Judged:
    """Judge models by simulations of whole recordings, in which nothing is fed back."""
    bench, base = better_way(ways)
    loci = located(bench, base)
    tell(place_sentence(loci, bench))
    tell("what happened long ago does not matter here: whole simulations are judged")
    thresholds = SIMULATED if case.thresholds is EVERYWHERE else case.thresholds
    found = alone(raw, base)
    selection = selected(found.bench, found.base, {}, thresholds, tell, LEFT_OUT)
    says = _says(selection, loci, found.bench, max(USUAL, thresholds.most))
    bench = dataclasses.replace(bench, series=found.bench.series)
    return _Judged(bench, found.base, selection, loci, says, thresholds)


def _held_out(
    case: Case, automaton: Automaton, seen: Sequence[str], is_linear: bool
) -> tuple[tuple[Series, ...], tuple[str, ...]]:
    """Open what is held out; what cannot be read is told, for the verdict stands without it."""
    held: list[Series] = []
    unread = []
    for path in case.held_out:
        try:
            held += paced(read_series(path, case, automaton, seen), automaton, seen, is_linear)
        except (SpecError, ValueError) as error:
            why = error.problems[0].label if isinstance(error, SpecError) else str(error)
            unread.append(f"{case.name_of(path)} was held out and cannot be used: {why}")
    return tuple(held), tuple(unread)


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
    recording = read_recording(path, case.mapping, used)
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


def _thresholds(
    case: Case,
    bench: Bench,
    base: Estimate,
    raw: Sequence[Series],
    tell: Tell,
) -> Thresholds:
    """Return the thresholds of a case: given, kept from an earlier bootstrap, or made by one."""
    if case.bootstrap == "never":
        return case.thresholds
    kept = kept_thresholds(bench, raw)
    if kept is None and case.bootstrap == "made":
        units = units_of(base.candidate, bench.series, base.noises, base.values(0))
        kept = bootstrapped(bench, base, units, raw, tell)
    found = kept or case.thresholds
    tell(f"thresholds of {found.text} nats, {found.origin}")
    return found


def _says(selection: Selection, loci: Sequence[Locus], bench: Bench, needed: float) -> Says:
    if not selection.accepted:
        shrink = 1.0 / inflation(selection.base, bench.series)
        unexplained = max((locus.beyond for locus in loci), default=0.0) * shrink
        return "unknown" if unexplained > UNKNOWN * needed else "nothing_missing"
    best = selection.accepted[0].evidence
    rivals = [tried.evidence for tried in selection.rivals if tried.evidence]
    if best and any(rival.total > best.total - CLEAR for rival in rivals):
        return "ambiguous"
    return "effect"


def _shuffles(selection: Selection, bench: Bench) -> tuple[Shuffle, ...]:
    models = [selection.base, *([selection.model] if selection.accepted else [])]
    found = [shuffle_of(model, bench.series) for model in models]
    return tuple(one for one in found if one is not None) if found[0] is not None else ()


def _told_apart(selection: Selection, automaton: Automaton) -> list[tuple[str, Estimate]]:
    """Return the first accepted effect and its rivals, by name."""
    some = (*selection.accepted[:1], *selection.rivals)
    return [
        (f"{verdict_id(tried.layer, automaton)}@{place_path(tried.layer)}", tried.estimate)
        for tried in some
        if tried.estimate is not None and tried.estimate.normal is not None
    ]


def _verdict(
    says: Says,
    selection: Selection,
    loci: Sequence[Locus],
    automaton: Automaton,
    fit: dict[str, dict[str, Misfit]],
) -> Verdict:
    probabilities = selection.probabilities()
    ranked = tuple(
        Ranked(
            verdict_id(tried.layer, automaton),
            place_path(tried.layer),
            probabilities[tried.layer.id],
            tried.evidence.train,
            float(np.std(tried.evidence.each) * np.sqrt(len(tried.evidence.each))),
        )
        for tried in selection.first_round
        if tried.evidence
    )
    effects = tuple(named(tried.layer, selection.model, automaton) for tried in selection.accepted)
    rivals = tuple(_named_alone(tried, automaton) for tried in selection.rivals)
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    base = {name: (before[name], after.get(name, before[name])) for name in before}
    return Verdict(
        says,
        effects if says == "effect" else (),
        ranked,
        probabilities["other"],
        rivals if says == "effect" else (*effects, *rivals) if says == "ambiguous" else (),
        tuple(loci),
        fit,
        base,
        None,
        0.0,
    )


def _named_alone(tried: Tried, automaton: Automaton) -> Named:
    assert tried.estimate is not None
    return named(tried.layer, tried.estimate, automaton)


def _confirmed(verdict: Verdict, selection: Selection, held: tuple[Series, ...]) -> Verdict:
    """Return the verdict with what the held out recordings say of it."""
    base = adapted(selection.base, held)
    model = adapted(selection.model, held)
    fit = {**verdict.fit, "held_out": misfits(base, model, held)}
    confirmed = model.likelihood < base.likelihood if selection.accepted else None
    return dataclasses.replace(verdict, fit=fit, confirmed=confirmed)


def _digest(path: Path) -> str:
    return hashlib.sha256(file_of(path).read_bytes()).hexdigest()[:16]
