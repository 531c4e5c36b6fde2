"""Judgement: which models of a case are accepted, from its training recordings alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from diagnosis.adequacy import (
    hardly_shows,
    is_inadequate,
    piles_up,
    refused,
    remembers_mostly,
)
from diagnosis.alone import LEFT_OUT, PROMISED, SIMULATED, alone, forgets
from diagnosis.bench import Bench
from diagnosis.bootstrap import bootstrapped, kept_thresholds
from diagnosis.case import Case
from diagnosis.constancy import differs
from diagnosis.description import Description, described
from diagnosis.doubt import (
    explains_more,
    is_doubtful,
    is_still,
    leaves_much,
    left_over,
    selected_formula,
)
from diagnosis.estimate import Estimate
from diagnosis.hidden import with_hidden
from diagnosis.level import units_of
from diagnosis.location import located, unexplained
from diagnosis.locus import Locus
from diagnosis.naming import verdict_id
from diagnosis.place_sentence import place_sentence
from diagnosis.plainer import may_be_plainer, plainer_ones
from diagnosis.pressed import is_opposed
from diagnosis.search import Tell
from diagnosis.selection import Selection, selected
from diagnosis.series import Series
from diagnosis.strain import is_at_limit, is_strained
from diagnosis.sureness import less_sure
from diagnosis.threshold import EVERYWHERE, USUAL, Thresholds
from diagnosis.verdict import Says
from diagnosis.ways import Way, better_way, chosen

CLEAR = 1.0
"""A rival of another name within this of the best [nats] makes the verdict ambiguous."""
HIDDEN = 6.0
"""Times the threshold that an input must gain that acts in windows."""
FREEDOM = 4.0
"""Times the threshold that free drifts must gain where effects are to be something else."""
UNKNOWN = 8.0
"""Times the threshold that a free drift must gain where no effect was accepted."""


@dataclass(frozen=True)
class Judgement:
    """What selection has come to; `bench` has the recordings as they were judged."""

    bench: Bench
    base: Estimate
    selection: Selection
    loci: tuple[Locus, ...]
    says: Says
    thresholds: Thresholds
    description: Description | None = None


def judged(case: Case, raw: Bench, ways: Sequence[Way], tell: Tell) -> Judgement:
    """Return what is accepted of a case, for the ways that its recordings can be read in.

    A model that forgets is judged by whole simulations, every other by what its observer foresees.
    """
    bench, base = better_way(ways)
    if forgets(base, bench.series):
        return _judged_by_simulation(case, raw, bench, base, tell)
    return _judged_by_observer(case, raw, ways, tell)


def _judged_by_observer(case: Case, raw: Bench, ways: Sequence[Way], tell: Tell) -> Judgement:
    """Judge models by what an observer foresees from sample to sample."""
    thresholds = _thresholds(case, *better_way(ways), raw.series, tell)
    most = max(USUAL, thresholds.most)
    bench, base, selection = chosen(ways, thresholds, tell)
    units = units_of(base.candidate, bench.series, base.values(0))
    loci = located(bench, base)
    tell(place_sentence(loci, bench))
    selection, loci = with_hidden(bench, selection, loci, HIDDEN * most, tell)
    left = unexplained(bench, selection.base, loci)
    says = _says(selection, left, bench, most)
    formula = None
    over = left_over(bench, selection, units) if says == "effect" else 0.0
    if is_doubtful(says, selection, left, over, most):
        formula = described(bench, selection.base, loci, units, most, tell)
    if formula is not None and explains_more(formula, selection):
        says, selection = "unknown", selected_formula(selection, formula)
    else:
        formula = None
        is_free = says == "effect" and not selection.has_hidden
        is_other = is_free and leaves_much(selection, over, most)
        says, selection = _adequate(bench, selection, says, FREEDOM * most, units, is_other, tell)
    return Judgement(bench, base, selection, loci, says, thresholds, formula)


def _adequate(
    bench: Bench,
    selection: Selection,
    says: Says,
    needed: float,
    units: Mapping[str, float],
    is_other: bool,
    tell: Tell,
) -> tuple[Says, Selection]:
    """Return a verdict, or `unknown` without effects that leave much of it unexplained.

    `is_other` where what they leave over at their places is known to be much.
    """
    if not selection.accepted:
        return says, selection
    is_free = says == "effect" and not is_still(selection, units) and not selection.has_hidden
    why = "terms at their places explain much beside them" if is_other else ""
    why = why or _why_not(selection, bench)
    if not why and is_free and is_inadequate(bench, selection, needed):
        why = "free drifts explain much beside them"
    if not why:
        return says, less_sure(bench, selection, tell) if says == "effect" else selection
    names = ", ".join(tried.layer.id for tried in selection.accepted)
    tell(f"taken back: {names}: {why}, so it is something else")
    return "unknown", refused(selection)


def _why_not(selection: Selection, bench: Bench) -> str:
    """Return why accepted effects are something else; nothing where they seem to be right.

    Beside a hidden input, which takes up anything at all, only ends of ranges are looked at.
    """
    first = selection.accepted[0]
    if is_at_limit(selection.model, first.layer):
        return "the first is at the end of a range"
    if selection.has_hidden:
        return ""
    if is_strained(selection.model, selection.accepted):
        return "they are pulled out of their ranges"
    if differs(selection.model, first, bench.series, len(selection.accepted) == 1):
        return "the parameters of the first differ from recording to recording"
    if is_opposed(selection.model, first.layer, bench.automaton):
        return "the first is more than what its balance can give up for it"
    if piles_up(selection):
        return "two at one place gain alike"
    if remembers_mostly(bench, selection):
        return "most recordings remember what is left"
    if hardly_shows(bench, selection):
        return "simulations hardly show them"
    is_known = any(plainer_ones(first, selection.first_round))
    if not is_known and may_be_plainer(selection.model, first.layer, bench.series):
        return "the first may as well be a plainer one"
    return ""


def _judged_by_simulation(
    case: Case, raw: Bench, bench: Bench, base: Estimate, tell: Tell
) -> Judgement:
    """Judge models by simulations of whole recordings, in which nothing is fed back."""
    loci = located(bench, base)
    tell(place_sentence(loci, bench))
    left = unexplained(bench, base, loci)
    tell("what happened long ago does not matter here: whole simulations are judged")
    thresholds = SIMULATED if case.thresholds == EVERYWHERE else case.thresholds
    found = alone(raw, base)
    selection = selected(found.bench, found.base, {}, thresholds, tell, LEFT_OUT, hope=PROMISED)
    says = _says(selection, left, found.bench, max(USUAL, thresholds.most))
    bench = dataclasses.replace(bench, series=found.bench.series)
    return Judgement(bench, found.base, selection, loci, says, thresholds)


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
        units = units_of(base.candidate, bench.series, base.values(0))
        kept = bootstrapped(bench, base, units, raw, tell)
    found = kept or case.thresholds
    tell(f"thresholds of {found.text} nats, {found.origin}")
    return found


def _says(selection: Selection, left: float, bench: Bench, needed: float) -> Says:
    """Return the verdict of a selection; `left` is what the base leaves unexplained [nats]."""
    if not selection.accepted:
        return "unknown" if left > UNKNOWN * needed else "nothing_missing"
    best, automaton = selection.accepted[0], bench.automaton
    name = verdict_id(best.layer, automaton)
    others = (one for one in selection.rivals if verdict_id(one.layer, automaton) != name)
    is_open = any(one.score > best.score - CLEAR for one in others)
    return "ambiguous" if is_open else "effect"
