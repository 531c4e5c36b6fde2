"""Adequacy: whether accepted effects leave more unexplained than they explain.

If the library lacks the true effect, the nearest one still gains a lot. But free disturbances then
gain much beside it, and the innovations of the model are autocorrelated.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from diagnosis.criterion.effective_sample_size import (
    integrated_autocorrelation,
    integrated_autocorrelation_by_recording,
)
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.ranking import disturbance_locations
from diagnosis.model.placed_effect import PlacedEffect, place_path, varies_slowly
from diagnosis.selection.forward_selection import Selection
from diagnosis.selection.stopping import disturbance_gain
from diagnosis.validation.free_simulation import nrmse

MAX_REMAINING_FRACTION = 0.12
"""Fraction of the effects' gain that free disturbances may gain beside them."""
MIN_AUTOCORRELATION = 1.2
"""Integrated autocorrelation above which innovations are autocorrelated."""
WITHDRAWAL_AUTOCORRELATION = 1.6
"""The same above which an effect is withdrawn; a stepwise rate limit has 1.54."""
MAX_AUTOCORRELATION_RATIO = 0.25
"""Fraction of the base's excess autocorrelation that an adequate model may leave.

White noise has none, and a slightly wrong form leaves little.
"""
MAX_MEDIAN_RATIO = 0.2
"""The same for the median over recordings, a few of which may differ."""

STRONG_AUTOCORRELATION, MAX_STRONG_MEDIAN_RATIO = 3.0, 0.05
"""Integrated autocorrelation that is strong, and the median fraction that may then be left.

The lag of a sensor that imitates a delay leaves a tenth.
"""

STACKED_FRACTION = 0.35
"""Fraction of an effect's gain from which a second effect at its place shows that both are wrong.

Beside right effects it is 0.28 at most.
"""

SMALL_GAIN = 800.0
"""Total gain [nats] below which effects must improve the simulation as well."""
MIN_MISFIT_RATIO = 0.85
"""Ratio of simulation misfits above which the simulation is not improved.

A model that predicts slightly better and simulates no better is adapted to the recordings only.
"""

REJECTION_LEAD = 20.0
"""Lead [nats] of "none of these" over the best candidate after a rejection."""


def is_inadequate(model_set: ModelSet, selection: Selection, min_gain: float) -> bool:
    """Return whether free disturbances gain much beside the accepted effects.

    Their gain (`free_disturbance_gain`) must exceed `min_gain` [nats] and `MAX_REMAINING_FRACTION`
    (0.12) of the sum of the effects' penalised gains.
    """
    known = [
        tried.likelihood_gain.penalised for tried in selection.accepted if tried.likelihood_gain
    ]
    return free_disturbance_gain(model_set, selection) > max(
        min_gain, MAX_REMAINING_FRACTION * sum(known)
    )


def free_disturbance_gain(model_set: ModelSet, selection: Selection) -> float:
    """Return the effective gain [nats] of free disturbances in all balances and elastic elements.

    Parameters are fitted with them. The elements are left out if the gain with them is not finite;
    the result is infinite if that without them is not finite either. An effect that varies slowly,
    such as a grade, excludes its place. Outputs are not included, because a sensor error follows
    any error of the model. The gain is divided by the integrated autocorrelation.
    """
    inside = [
        placed_effect
        for section, placed_effect in disturbance_locations(model_set)
        if section == "elements"
    ]
    gains = (
        _disturbance_gain(model_set, selection, some)
        for some in ((*model_set.disturbances, *inside), model_set.disturbances)
    )
    return next((gain for gain in gains if np.isfinite(gain)), np.inf)


def _disturbance_gain(
    model_set: ModelSet, selection: Selection, disturbances: Sequence[PlacedEffect]
) -> float:
    """Return the effective gain [nats] of some free disturbances;
    -inf if they cannot be combined.
    """
    held = {
        tried.placed_effect.place
        for tried in selection.accepted
        if varies_slowly(tried.placed_effect)
    }
    gain = disturbance_gain(model_set, selection.model, disturbances, held)
    return gain / integrated_autocorrelation(selection.model, model_set.series)


def has_autocorrelated_residuals(model_set: ModelSet, selection: Selection) -> bool:
    """Return whether innovations keep much of the autocorrelation that they had in the base.

    The integrated autocorrelation of the final model must exceed `MIN_AUTOCORRELATION` (1.2), and
    its excess over 1 must exceed `MAX_AUTOCORRELATION_RATIO` (0.25) of the excess of the base.
    """
    before, after = (
        integrated_autocorrelation(one, model_set.series)
        for one in (selection.base, selection.model)
    )
    return after > MIN_AUTOCORRELATION and after - 1.0 > MAX_AUTOCORRELATION_RATIO * (before - 1.0)


def has_autocorrelated_residuals_in_most(model_set: ModelSet, selection: Selection) -> bool:
    """Return whether innovations are autocorrelated, also in most recordings where the base's were.

    All recordings together must have at least `WITHDRAWAL_AUTOCORRELATION` (1.6), and either more
    than `STRONG_AUTOCORRELATION` (3) or autocorrelated residuals. Then the median over recordings
    of the fraction of the base's excess that is left must exceed `MAX_MEDIAN_RATIO` (0.2), or
    `MAX_STRONG_MEDIAN_RATIO` (0.05) in the strong case; only recordings with more than
    `MIN_AUTOCORRELATION` in the base count, and without any the result is True. An inexact form
    shows in those few that drive it far.
    """
    together = integrated_autocorrelation(selection.model, model_set.series)
    is_loud = together > STRONG_AUTOCORRELATION
    if together < WITHDRAWAL_AUTOCORRELATION or not (
        is_loud or has_autocorrelated_residuals(model_set, selection)
    ):
        return False
    before, after = (
        integrated_autocorrelation_by_recording(one, model_set.series)
        for one in (selection.base, selection.model)
    )
    heard = before > MIN_AUTOCORRELATION
    left = (after[heard] - 1.0) / (before[heard] - 1.0)
    return not heard.any() or float(np.median(left)) > (
        MAX_STRONG_MEDIAN_RATIO if is_loud else MAX_MEDIAN_RATIO
    )


def has_stacked_effects(selection: Selection) -> bool:
    """Return whether a further effect at the same place gains much of what the first one gained.

    Its penalised gain must exceed `STACKED_FRACTION` (0.35) of that of the first accepted effect at
    the same `section.place`. Two such effects together imitate a third one.
    """
    firsts: dict[str, float] = {}
    for tried in selection.accepted:
        path, gained = (
            place_path(tried.placed_effect),
            tried.likelihood_gain.penalised if tried.likelihood_gain else 0.0,
        )
        if path in firsts and gained > STACKED_FRACTION * firsts[path]:
            return True
        firsts.setdefault(path, gained)
    return False


def lacks_simulation_improvement(model_set: ModelSet, selection: Selection) -> bool:
    """Return whether effects of small gain leave the simulation misfit nearly unchanged.

    The sum of their penalised gains must be at most `SMALL_GAIN` (800 nats), and the mean over
    outputs of the ratio of normalised misfits, after over before, must exceed `MIN_MISFIT_RATIO`
    (0.85).
    """
    gained = sum(
        tried.likelihood_gain.penalised for tried in selection.accepted if tried.likelihood_gain
    )
    if gained > SMALL_GAIN:
        return False
    before, after = (nrmse(one, model_set.series) for one in (selection.base, selection.model))
    return float(np.mean(after / np.maximum(before, 1e-12))) > MIN_MISFIT_RATIO


def reject_effects(selection: Selection) -> Selection:
    """Return a selection without accepted effects and rivals in which no candidate is likely.

    Its model is the base; `other` becomes the largest total gain of the first round, or `other`
    itself if that is larger, plus `REJECTION_LEAD` (20 nats).
    """
    totals = [
        tried.likelihood_gain.total for tried in selection.first_round if tried.likelihood_gain
    ]
    other = max(selection.other, *totals) + REJECTION_LEAD
    return dataclasses.replace(selection, model=selection.base, accepted=(), rivals=(), other=other)
