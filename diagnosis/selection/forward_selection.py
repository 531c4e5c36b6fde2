"""Forward selection: effects are accepted one after the other, each by the same criterion.

The base of the next comparison contains the accepted effects (docs/method.md).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from diagnosis.criterion.explained_share import (
    MAX_ORDINARY_ENERGY,
    MIN_SHARE,
    USUAL_FORM_ERROR,
    explained_share,
    is_ordinary,
    log_form_weight,
    remaining_energy,
)
from diagnosis.criterion.threshold import DEFAULT_THRESHOLDS, Thresholds
from diagnosis.estimation.estimate import Estimate, with_best_gain_scale
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.comparison import Round, compare_candidates, effective_gain, judge
from diagnosis.selection.intersample import LogCallback
from diagnosis.validation.free_simulation import complete_nrmse

MAX_EFFECTS = 3
"""Largest number of accepted effects."""
SET_PROBABILITY = 0.95
"""Probability of the set of an effect and its rivals."""
MIN_RIVAL_RATIO = 0.5
"""Probability, relative to that of another effect, from which an effect may be the right one."""


@dataclass(frozen=True)
class Selection:
    """The accepted effects: `model` extends `base`, `first` is the comparison beside the base.

    `rivals` are the candidates that the recordings do not separate from the first accepted effect.
    `share` is the part of the energy of the base that the model explains.
    """

    base: Estimate = field(repr=False)
    model: Estimate = field(repr=False)
    accepted: tuple[CandidateFit, ...]
    first: Round = field(repr=False)
    last: Round = field(repr=False)
    rivals: tuple[CandidateFit, ...] = ()
    share: float = 0.0

    @property
    def first_round(self) -> tuple[CandidateFit, ...]:
        """All candidates beside the base, the largest gain first."""
        return self.first.candidates

    def probabilities(self) -> dict[str, float]:
        """Return the probability of each fitted candidate beside the base by id, and of `other`."""
        return candidate_probabilities(self.first)


def candidate_probabilities(compared: Round) -> dict[str, float]:
    """Return the probability of each fitted candidate by id, and of none of them as `other`.

    They are the posterior masses of the explained shares under the model discrepancy
    (`log_form_weight`).
    """
    energy = compared.sampled_energy
    weights = {
        one.placed_effect.id: log_form_weight(1.0 - one.share, energy, one.parameter_count)
        for one in compared.candidates
        if one.is_fitted
    }
    weights["other"] = log_form_weight(None, energy)
    most = max(weights.values())
    masses = {name: math.exp(weight - most) for name, weight in weights.items()}
    whole = sum(masses.values())
    return {name: mass / whole for name, mass in masses.items()}


def select_effects(
    model_set: ModelSet,
    base: Estimate,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    log: LogCallback = lambda text: None,
    preferred: Collection[str] = (),
) -> Selection:
    """Return the effects that the training recordings support, at most `MAX_EFFECTS` (3).

    The candidate with the largest gain is accepted if it gains its threshold and explains most of
    what any disturbance explains. If it explains less, and the base leaves more than an ordinary
    disturbance, a second effect is tried beside it: both are accepted if they do so together. At
    last effects that the others make needless are dropped. Of the effects that could be the first
    one, one whose identifier is in `preferred` is taken, and its rivals and further effects are in
    `preferred` as well.
    """
    first = compare_candidates(model_set, base, model_set.applicable_effects(), log)
    found = Selection(first.base, first.base, (), first, first)
    best = _best_candidate(model_set, first, thresholds, preferred)
    if best is None:
        return found
    if not first.is_explained_by(best):
        if first.is_ordinary:
            return found
        pair = _select_pair(model_set, found, best, thresholds, log)
        if not pair.accepted:
            return pair
        found = pair
    else:
        found = _accept(model_set, found, best, log)
    is_preferred = found.accepted[0].placed_effect.id in preferred
    while len(found.accepted) < MAX_EFFECTS:
        best = _best_candidate(model_set, found.last, thresholds)
        if best is None or not found.last.is_explained_by(best):
            break
        if is_preferred and best.placed_effect.id not in preferred:
            break
        found = _accept(model_set, found, best, log)
    found = _drop_needless(model_set, found, thresholds, log)
    rivals = _rivals(model_set, found.first, found.accepted[0])
    if found.accepted[0].placed_effect.id in preferred:
        rivals = tuple(one for one in rivals if one.placed_effect.id in preferred)
    return replace(found, rivals=rivals)


def _drop_needless(
    model_set: ModelSet, found: Selection, thresholds: Thresholds, log: LogCallback
) -> Selection:
    """Return the selection without the effects that do not gain their threshold beside the others.

    An effect that was accepted first may stand for others that were found later.
    """
    series = model_set.series
    for one in found.accepted[:-1]:
        others = [kept for kept in found.accepted if kept is not one]
        candidate = model_set.compile_candidate([kept.placed_effect for kept in others])
        start = extend_vector(candidate, found.model.candidate, found.model.point, {})
        levels = found.model.noise_levels
        fit = partial(estimate_parameters, candidate, series, levels, start)
        fitted = model_set.load_or_fit("without one", candidate, [start, levels], fit)
        without = with_best_gain_scale(fitted, series)
        gain = effective_gain(found.model, without, found.last.correlation, len(series))
        if gain < thresholds.threshold_of(one.placed_effect):
            log(f"dropped {one.placed_effect.id}: {gain:.0f} nats beside the others")
            found = _with_effects(model_set, found, others, without)
    return found


def _with_effects(
    model_set: ModelSet, found: Selection, accepted: Sequence[CandidateFit], model: Estimate
) -> Selection:
    """Return the selection with other effects; one alone is compared again with its new fit."""
    first = found.first
    if len(accepted) == 1:
        name = accepted[0].placed_effect.id
        rest = [one for one in first.candidates if one.placed_effect.id != name]
        single = replace(accepted[0], estimate=model)
        first = judge(model_set, first.base, first.free, [*rest, single])
        accepted = [one for one in first.candidates if one.placed_effect.id == name]
    share = explained_share(model, first.base, first.floor)
    return replace(found, model=model, accepted=tuple(accepted), first=first, share=share)


def tolerated_energy(first: Round) -> float:
    """Return the energy that accepted effects may leave: the error of their form, at most that of
    an ordinary disturbance. Whole simulations contain no ordinary disturbance.
    """
    levels = first.base.noise_levels
    if levels.is_output_error:
        return USUAL_FORM_ERROR**2 * remaining_energy(first.base, levels.outputs**2)
    return min(USUAL_FORM_ERROR**2 * first.energy, MAX_ORDINARY_ENERGY * len(first.floor))


def _best_candidate(
    model_set: ModelSet,
    compared: Round,
    thresholds: Thresholds,
    preferred: Collection[str] = (),
) -> CandidateFit | None:
    """Return the candidate that is the best explanation, None if none gains its threshold.

    The gain counts as far as it exceeds that of a negligible energy. The candidate explains enough,
    and enough of what is wrong in free simulations; beside accepted effects there must be such a
    candidate. Those in `preferred` go before others. Of several it is the one of `_most_probable`;
    if none explains enough, it is the one with the largest gain.
    """
    least = compared.negligible_gain
    enough = [
        one
        for one in compared.candidates
        if one.gain >= thresholds.threshold_of(one.placed_effect) + least
    ]
    explaining = [one for one in enough if compared.is_explained_by(one)]
    if not explaining:
        return next(iter(enough), None)
    simulating = _explain_simulations(model_set, compared, explaining)
    allowed = [one for one in simulating if one.placed_effect.id in preferred] or simulating
    is_first = not compared.base.candidate.placed_effects
    if allowed or is_first:
        return _most_probable(compared, allowed or explaining)
    return None


def _most_probable(compared: Round, candidates: Sequence[CandidateFit]) -> CandidateFit:
    """Return the candidate of largest gain of those that are at least `MIN_RIVAL_RATIO` (0.5) times
    as probable as the most probable one.

    A gain may come from parameters that describe the noise, so it decides only between candidates
    of about the same probability.
    """
    probabilities = candidate_probabilities(compared)
    known = [probabilities[one.placed_effect.id] for one in candidates]
    least = MIN_RIVAL_RATIO * max(known)
    pairs = zip(candidates, known, strict=True)
    return max((one for one, value in pairs if value >= least), key=lambda one: one.gain)


def _explain_simulations(
    model_set: ModelSet, compared: Round, candidates: Sequence[CandidateFit]
) -> list[CandidateFit]:
    """Return the candidates that explain enough of what is wrong in free simulations."""
    shares = simulated_shares(model_set, compared.base, candidates)
    pairs = zip(candidates, shares, strict=True)
    return [one for one, share in pairs if share >= MIN_SHARE]


def simulated_shares(
    model_set: ModelSet, base: Estimate, candidates: Sequence[CandidateFit]
) -> list[float]:
    """Return the share of the error of free simulation that each candidate explains.

    The error of the best of these models, channel by channel, is what nothing explains. All shares
    are 1 if the base exceeds it by no more than an ordinary disturbance, or if all simulations
    diverge; a candidate whose simulation diverges explains nothing.
    """
    errors = [complete_nrmse(one, model_set.series) ** 2 for one in _estimates(base, candidates)]
    finite = [error for error in errors if np.all(np.isfinite(error))]
    if not finite:
        return [1.0] * (len(errors) - 1)
    floor = np.maximum(np.min(finite, axis=0), np.finfo(float).tiny)
    before, *after = [float(np.sum(error / floor - 1.0)) for error in errors]
    if is_ordinary(before, len(floor)):
        return [1.0] * len(after)
    return [1.0 - remaining / before if np.isfinite(remaining) else -np.inf for remaining in after]


def _estimates(base: Estimate, candidates: Sequence[CandidateFit]) -> list[Estimate]:
    """Return the base and the fits of fitted candidates."""
    return [base, *(one.estimate for one in candidates if one.estimate is not None)]


def _accept(
    model_set: ModelSet, found: Selection, best: CandidateFit, log: LogCallback
) -> Selection:
    """Return the selection with one effect more, and the comparison beside it."""
    assert best.estimate is not None
    log(f"accepted {best.placed_effect.id}: {best.gain:.0f} nats, {best.share:.0%}")
    model = best.estimate
    last = compare_candidates(
        model_set, model, model_set.applicable_effects(), log, tolerated_energy(found.first)
    )
    accepted = (*found.accepted, best)
    share = explained_share(last.base, found.base, found.first.floor)
    return replace(found, model=last.base, accepted=accepted, last=last, share=share)


def _select_pair(
    model_set: ModelSet,
    found: Selection,
    best: CandidateFit,
    thresholds: Thresholds,
    log: LogCallback,
) -> Selection:
    """Return the selection with two effects that together explain most; else without any."""
    pair = _accept(model_set, found, best, log)
    second = _best_candidate(model_set, pair.last, thresholds)
    if second is not None and pair.last.is_explained_by(second):
        return _accept(model_set, pair, second, log)
    log(f"not accepted {best.placed_effect.id}: it explains {best.share:.0%}")
    return found


def _rivals(
    model_set: ModelSet, compared: Round, accepted: CandidateFit
) -> tuple[CandidateFit, ...]:
    """Return the candidates besides the accepted one that belong to the smallest set of hypotheses
    with a probability of `SET_PROBABILITY` (0.95); `other` counts as a hypothesis.

    If the accepted effect explains the free simulations, its rivals do so as well.
    """
    fits = {one.placed_effect.id: one for one in compared.candidates}
    probabilities = candidate_probabilities(compared)
    rivals, total = [], 0.0
    for name, probability in sorted(probabilities.items(), key=lambda item: -item[1]):
        if total >= SET_PROBABILITY:
            break
        total += probability
        if name in fits and name != accepted.placed_effect.id:
            rivals.append(fits[name])
    simulating = _explain_simulations(model_set, compared, [accepted, *rivals])
    return tuple(one for one in rivals if one in simulating or accepted not in simulating)
