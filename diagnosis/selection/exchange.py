"""Exchange step: an accepted effect is replaced by one that fits better together with the others.

While other effects are missing, the candidate with the most freedom explains some of them as well:
friction with a rise at standstill absorbs part of an offset, which dry friction cannot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from diagnosis.criterion.likelihood_gain import LikelihoodGain, add_gains, likelihood_gain
from diagnosis.estimation.estimate import Estimate, evaluate_near
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import fit_candidate
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, extend_vector
from diagnosis.model.placed_effect import PlacedEffect
from diagnosis.selection.bound_score import is_at_bound
from diagnosis.selection.candidate_search import CandidateFit, LogCallback
from diagnosis.selection.confusion_set import CONFUSION_FRACTION
from diagnosis.selection.nested_form import accepts_restriction
from diagnosis.selection.screening import start_values

MIN_EXCHANGE_GAIN = 3.0
"""Nats by which the model must be better with the other effect."""
RIVAL_FRACTION, CONFUSED_FRACTION = 0.5, 0.25
"""Part of what an accepted effect gained that another one gained alone, if it may stand for it; and
one that it is known to be confused with."""


def exchange_effects(
    model_set: ModelSet,
    model: Estimate,
    accepted: Sequence[CandidateFit],
    rivals: Sequence[CandidateFit],
    units: Mapping[str, float],
    log: LogCallback,
) -> tuple[list[CandidateFit], Estimate]:
    """Return the accepted effects and their model, each but the last exchanged if that gains.

    Replacements are `rivals` at the same place. One that is known to be confused with the effect is
    tried even if it was not fitted alone, and then needs a larger gain.
    """
    kept = list(accepted)
    for k, old in enumerate(accepted[:-1]):
        for rival in rivals:
            ids = {tried.placed_effect.id for tried in kept}
            if rival.placed_effect.id in ids or not _is_exchangeable(rival, old):
                continue
            placed_effects = [
                rival.placed_effect if tried is kept[k] else tried.placed_effect for tried in kept
            ]
            candidate = model_set.try_compile(placed_effects)
            if candidate is None:
                continue
            start = _start_point(model_set, candidate, rival, model)
            tried = fit_candidate(
                candidate, model_set.series, model.noise_levels, start, units, nearby=model
            )
            if accepts_restriction(tried, rival.placed_effect, model_set.series):
                continue
            gained = likelihood_gain(tried, model, model_set.series)  # prices counted
            if gained.penalised > _required_gain(kept[k], tried, rival.placed_effect):
                old_id = kept[k].placed_effect.id
                log(f"{rival.placed_effect.id} fits the others better than {old_id}")
                kept[k], model = _assign_gain(rival, kept[k], tried, gained), tried
    return kept, model


def _required_gain(
    accepted_fit: CandidateFit, model: Estimate, placed_effect: PlacedEffect
) -> float:
    """Return what a model with a rival in the place of an accepted effect has to gain [nats]: where
    the rival is at a limit, more than what keeps nearly as good ones apart.
    """
    gained = accepted_fit.likelihood_gain.penalised if accepted_fit.likelihood_gain else 0.0
    return (
        max(MIN_EXCHANGE_GAIN, (1.0 - CONFUSION_FRACTION) * gained)
        if is_at_bound(model, placed_effect)
        else MIN_EXCHANGE_GAIN
    )


def _is_exchangeable(rival: CandidateFit, accepted_fit: CandidateFit) -> bool:
    """Tell whether a rival is at the place of an accepted effect, and gained not much less or is
    one that this is confused with.
    """
    if (
        rival.placed_effect.place != accepted_fit.placed_effect.place
        or accepted_fit.likelihood_gain is None
    ):
        return False
    is_confused = rival.placed_effect.effect.name in accepted_fit.placed_effect.effect.confused_with
    if rival.likelihood_gain is None:
        return is_confused
    part = CONFUSED_FRACTION if is_confused else RIVAL_FRACTION
    return rival.likelihood_gain.penalised > part * accepted_fit.likelihood_gain.penalised


def _assign_gain(
    rival: CandidateFit, accepted_fit: CandidateFit, model: Estimate, gain: LikelihoodGain
) -> CandidateFit:
    """Return a rival with what it gains alone, or what it gains in the place of the old one."""
    if rival.likelihood_gain is not None or accepted_fit.likelihood_gain is None:
        return rival
    return CandidateFit(
        rival.placed_effect,
        rival.screening_gain,
        model,
        add_gains(accepted_fit.likelihood_gain, gain),
    )


def _start_point(
    model_set: ModelSet, candidate: Candidate, rival: CandidateFit, model: Estimate
) -> ParameterVector:
    """Return where a fit with a rival begins: where it was alone, or the best of its starts."""
    given = candidate, model.candidate, model.point
    if rival.estimate is not None:
        alone = rival.estimate
        return extend_vector(*given, extend_vector(candidate, alone.candidate, alone.point, {}))
    starts = [extend_vector(*given, start) for start in start_values(candidate, model.values(0))]
    return min(
        starts,
        key=lambda p: evaluate_near(candidate, model_set.series, model.noise_levels, p, model).cost,
    )
