"""Backward elimination: removal of accepted effects that later ones make unnecessary.

An effect is accepted while others are still missing, so it may have replaced one of them. The gain
of a removed effect is reassigned to effects at its place.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from diagnosis.criterion.likelihood_gain import LikelihoodGain, likelihood_gain, subtract_gains
from diagnosis.criterion.recording_support import supported_gain
from diagnosis.criterion.threshold import Thresholds
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import fit_with_noise
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.model.placed_effect import place_path
from diagnosis.selection.candidate_search import CandidateFit, LogCallback

MIN_ADDED_FRACTION = 0.25
"""Part of what another one at its place gains that an effect found before it must add to that: it
may have stood in for it."""


@dataclass(frozen=True)
class AcceptedEffects:
    """Effects that extend `base` to `model`, in the order of their acceptance."""

    base: Estimate
    model: Estimate
    effects: tuple[CandidateFit, ...]


def eliminate_backward(
    model_set: ModelSet,
    accepted: AcceptedEffects,
    units: Mapping[str, float],
    thresholds: Thresholds,
    log: LogCallback,
) -> AcceptedEffects:
    """Return the effects without unnecessary ones,
    and with the most valuable one at a place first.
    """
    for tried in accepted.effects[:-1]:
        without = _fit_without(model_set, accepted, tried, units)
        if without is None:
            continue
        worth = likelihood_gain(accepted.model, without, model_set.series)
        beside = [t for t in accepted.effects if t is not tried and _path(t) == _path(tried)]
        most = max((t.likelihood_gain.penalised for t in beside if t.likelihood_gain), default=0.0)
        gained = sum(t.likelihood_gain.penalised for t in beside if t.likelihood_gain)
        if supported_gain(worth) <= max(
            thresholds.threshold_of(tried.placed_effect), MIN_ADDED_FRACTION * gained
        ):
            log(f"{tried.placed_effect.id} is needless beside the others")
            rest = tuple(t for t in accepted.effects if t is not tried)
            accepted = AcceptedEffects(
                accepted.base,
                without,
                _reassign_gain(model_set, rest, tried, accepted.base, without),
            )
        elif worth.penalised < most:
            log(f"{tried.placed_effect.id} adds less than what was found after it at its place")
            rest = tuple(t for t in accepted.effects if t is not tried)
            first = _reassign_gain(model_set, rest, tried, accepted.base, without)
            last = dataclasses.replace(tried, likelihood_gain=worth)
            accepted = AcceptedEffects(accepted.base, accepted.model, (*first, last))
        else:
            new = dataclasses.replace(tried, joint_gain=worth.penalised)
            kept = tuple(new if t is tried else t for t in accepted.effects)
            accepted = AcceptedEffects(accepted.base, accepted.model, kept)
    return accepted


def _fit_without(
    model_set: ModelSet,
    accepted: AcceptedEffects,
    candidate_fit: CandidateFit,
    units: Mapping[str, float],
) -> Estimate | None:
    """Return the model without one of its effects, fitted from where it is."""
    candidate = model_set.try_compile(
        [other.placed_effect for other in accepted.effects if other is not candidate_fit]
    )
    if candidate is None:
        return None
    start = extend_vector(candidate, accepted.model.candidate, accepted.model.point, {})
    given = (accepted.base.noise_levels, start, units)
    make = partial(fit_with_noise, candidate, model_set.series, *given, nearby=accepted.model)
    return model_set.load_or_fit("settled", candidate, (*given, accepted.model.gains), make)


def _reassign_gain(
    model_set: ModelSet,
    remaining: tuple[CandidateFit, ...],
    removed: CandidateFit,
    base: Estimate,
    model: Estimate,
) -> tuple[CandidateFit, ...]:
    """Return the rest with what it gains without the one that is gone: the first one at its place,
    or the first of all, has what the others have not.
    """
    recipient = next((t for t in remaining if _path(t) == _path(removed)), remaining[0])
    others = [t.likelihood_gain for t in remaining if t is not recipient and t.likelihood_gain]
    own: LikelihoodGain = subtract_gains(likelihood_gain(model, base, model_set.series), others)
    estimate = model if len(remaining) == 1 else recipient.estimate
    new = dataclasses.replace(recipient, likelihood_gain=own, estimate=estimate)
    return tuple(new if t is recipient else t for t in remaining)


def update_first_round(
    first: Sequence[CandidateFit], before: Sequence[CandidateFit], retained: Sequence[CandidateFit]
) -> list[CandidateFit]:
    """Return the first round: removed effects are not fitted,
    the first retained one has its new gain.
    """
    out = {t.placed_effect.id for t in before} - {t.placed_effect.id for t in retained}
    left = [
        CandidateFit(t.placed_effect, t.screening_gain) if t.placed_effect.id in out else t
        for t in first
    ]
    leading = {t.placed_effect.id: t for t in retained[:1]}
    return [leading.get(t.placed_effect.id, t) for t in left]


def _path(candidate_fit: CandidateFit) -> str:
    return place_path(candidate_fit.placed_effect)
