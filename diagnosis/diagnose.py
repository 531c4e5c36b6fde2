"""Diagnose: recordings against a model - recalibrate, locate, name, model, show.

Selection knows the training recordings alone. What is held out is opened after that is final; it
can confirm the verdict or not, and change nothing else.
"""

from __future__ import annotations

import dataclasses
import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from diagnosis.adaptation import adapted
from diagnosis.bench import Bench
from diagnosis.case import Case, case_bench, read_series
from diagnosis.description import Description
from diagnosis.estimate import Estimate
from diagnosis.judgement import judged
from diagnosis.layers import Layer
from diagnosis.location import led_by, likely
from diagnosis.locus import Locus
from diagnosis.naming import named, place_path, quantities_of, verdict_id
from diagnosis.place_sentence import place_sentence
from diagnosis.plan import Plan, planned
from diagnosis.rival import nearest
from diagnosis.search import Tell, Tried
from diagnosis.selection import Selection
from diagnosis.series import Series, compared, paced
from diagnosis.shuffle import Shuffle, shuffle_of
from diagnosis.simulation import misfits
from diagnosis.starting import settled_at_start, started
from diagnosis.threshold import EVERYWHERE, Thresholds
from diagnosis.verdict import Misfit, Named, Ranked, Says, Verdict
from diagnosis.ways import ways_of
from engine.recorded_part import file_of, overlap
from language.load import automaton_of
from language.model import Automaton
from language.problem import SpecError

LITTLE_MORE = 1.1
"""Part of the misfit of simulation from which on a signal is simulated worse."""
MUCH_LESS = 0.8
"""Part of the misfit of simulation that is left at most where an effect is confirmed by it."""


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
    found = judged(case, raw, ways, tell)
    bench, selection, loci = found.bench, found.selection, found.loci
    plan = planned(bench, _told_apart(selection, automaton))
    if plan is not None:
        tell(plan.sentence())
    loci = led_by(loci, [place_path(tried.layer) for tried in selection.accepted], bench)
    if found.says == "unknown":
        near = _near(selection, found.thresholds.usual)
        selection = dataclasses.replace(selection, rivals=nearest(near))
        loci = likely(loci, [place_path(one.layer) for one in near], bench)
    fit = {"train": misfits(found.base, selection.model, bench.series)}
    verdict = _verdict(found.says, selection, loci, automaton, fit)
    hashes = {case.name_of(path): _digest(path) for path in case.train}
    verdict = dataclasses.replace(verdict, inputs=hashes, messages=(place_sentence(loci, bench),))
    held, unread = _held_out(case, automaton, seen, bench.series[0].is_linear)
    for text in unread:
        tell(text)
    if held:
        tell(
            "held out: "
            + ", ".join(f"{case.name_of(path)} {_digest(path)}" for path in case.held_out)
        )
        held = started(selection.base, [settled_at_start(one) for one in held])
        verdict = _confirmed(verdict, selection, held)
    verdict = dataclasses.replace(verdict, runtime_s=time.monotonic() - begun)
    shuffles = _shuffles(selection, bench)
    known = found.description, found.thresholds, plan, shuffles
    return Diagnosis(verdict, selection, bench, held, *known, unread=unread)


def _held_out(
    case: Case, automaton: Automaton, seen: Sequence[str], is_linear: bool
) -> tuple[tuple[Series, ...], tuple[str, ...]]:
    """Open what is held out; what cannot be read is told, for the verdict stands without it."""
    held: list[Series] = []
    unread = []
    for k, path in enumerate(case.held_out):
        known = next((o for o in (*case.train, *case.held_out[:k]) if overlap(path, o)), None)
        if known is not None:
            named = f"{case.name_of(path)} was held out and cannot be used"
            unread.append(f"{named}: it is a copy of {case.name_of(known)}")
            continue
        try:
            held += paced(read_series(path, case, automaton, seen), automaton, seen, is_linear)
        except (SpecError, ValueError) as error:
            why = error.problems[0].label if isinstance(error, SpecError) else str(error)
            unread.append(f"{case.name_of(path)} was held out and cannot be used: {why}")
    return tuple(held), tuple(unread)


def _shuffles(selection: Selection, bench: Bench) -> tuple[Shuffle, ...]:
    models = [selection.base, *([selection.model] if selection.accepted else [])]
    found = [shuffle_of(model, bench.series) for model in models]
    return tuple(one for one in found if one is not None) if found[0] is not None else ()


def _near(selection: Selection, least: float) -> list[Tried]:
    """Return the candidates that gain more than the `least` [nats], best first."""
    rounds = selection.first_round
    near = [one for one in rounds if one.evidence and one.evidence.train > least]
    return sorted(near, key=lambda one: -one.score)


def _told_apart(selection: Selection, automaton: Automaton) -> list[tuple[str, Estimate]]:
    """Return the first accepted effect and its rivals, by name."""
    some = (*selection.accepted[:1], *selection.rivals)
    return [
        ("@".join(_name(tried.layer, automaton)), tried.estimate)
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
    effects = tuple(named(tried.layer, selection.model, automaton) for tried in selection.accepted)
    rivals = _rivals(selection, automaton)
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    base = {name: (before[name], after.get(name, before[name])) for name in before}
    return Verdict(
        says,
        effects if says == "effect" else (),
        _ranked(selection, automaton),
        selection.probabilities()["other"],
        (*effects, *rivals) if says == "ambiguous" else rivals,
        tuple(loci),
        fit,
        base,
        None,
        0.0,
    )


def _name(layer: Layer, automaton: Automaton) -> tuple[str, str]:
    """Return how verdicts name an effect, and its place."""
    return verdict_id(layer, automaton), place_path(layer)


def _ranked(selection: Selection, automaton: Automaton) -> tuple[Ranked, ...]:
    """Return the fitted candidates, best first: forms of one name at one place are one."""
    probabilities = selection.probabilities()
    found: dict[tuple[str, str], Ranked] = {}
    for tried in selection.first_round:
        if tried.evidence is None:
            continue
        name, each = _name(tried.layer, automaton), tried.evidence
        std = float(np.std(each.each) * np.sqrt(len(each.each)))
        new = Ranked(*name, probabilities[tried.layer.id], each.train, std)
        old = found.setdefault(name, new)
        if old is not new:
            both = old.probability + new.probability
            found[name] = dataclasses.replace(old, probability=both)
    return tuple(found.values())


def _rivals(selection: Selection, automaton: Automaton) -> tuple[Named, ...]:
    """Return the rivals as verdicts name them, but for other forms of what is named already."""
    taken = [_name(one.layer, automaton) for one in selection.accepted]
    found: dict[tuple[str, str], Named] = {}
    for tried in selection.rivals:
        name = _name(tried.layer, automaton)
        if name not in taken and tried.estimate is not None:
            found.setdefault(name, named(tried.layer, tried.estimate, automaton))
    return tuple(found.values())


def _confirmed(verdict: Verdict, selection: Selection, held: tuple[Series, ...]) -> Verdict:
    """Return the verdict with what the held out recordings say of it.

    They confirm it where they are foreseen better and no signal is simulated worse, or each much
    better: a base that drifts may foresee as well without knowing why.
    """
    base = adapted(selection.base, held)
    model = adapted(selection.model, held)
    shown = misfits(base, model, held)
    fit = {**verdict.fit, "held_out": shown}
    left = [one.nrmse_after / one.nrmse_before for one in shown.values() if one.nrmse_before]
    is_foreseen = model.likelihood < base.likelihood and max(left, default=0.0) < LITTLE_MORE
    is_better = is_foreseen or max(left, default=1.0) < MUCH_LESS
    confirmed = is_better if selection.accepted else None
    return dataclasses.replace(verdict, fit=fit, confirmed=confirmed)


def _digest(path: Path) -> str:
    return hashlib.sha256(file_of(path).read_bytes()).hexdigest()[:16]
