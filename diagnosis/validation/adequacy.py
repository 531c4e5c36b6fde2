"""Adequacy: whether effects that were accepted leave more unexplained than they explain.

The nearest effect of a library that lacks the true one gains a great deal; but drifts that are let
free still find much to do beside it, and innovations of the model remember, which noise does not.
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
"""Part of what was gained that drifts which are let free may gain beside it: forms differ."""
MIN_AUTOCORRELATION = 1.2
"""Innovations that count as one from which on those of a model remember."""
WITHDRAWAL_AUTOCORRELATION = 1.6
"""The same from which on a name is taken back: a rate limit by steps has 1.54."""
MAX_AUTOCORRELATION_RATIO = 0.25
"""Part of what the base's innovations remembered that those of an adequate model may: noise has no
memory, and a form that is not quite right leaves little of it."""
MAX_MEDIAN_RATIO = 0.2
"""The same for the recordings, for which it is the median: a few may be far from the others."""

STRONG_AUTOCORRELATION, MAX_STRONG_MEDIAN_RATIO = 3.0, 0.05
"""Innovations that count as one from which on those of a model are loud, and the typical part that
an adequate one may then leave: a sensor's lag that imitates its delay leaves a tenth."""

STACKED_FRACTION = 0.35
"""Part of what an effect gained that a further one gains at the same place, where neither is it:
0.28 at most beside right ones."""

SMALL_GAIN = 800.0
"""Nats that effects gained together below which simulations have to show them as well."""
MIN_MISFIT_RATIO = 0.85
"""Part of the misfit of simulation from which on they hardly show them: what foresees a little
better from sample to sample and simulates no better is bent to what is there."""

REJECTION_LEAD = 20.0
"""Nats by which "none of these" then leads the best candidate."""


def is_inadequate(model_set: ModelSet, selection: Selection, min_gain: float) -> bool:
    """Tell whether free drifts gain much of what the accepted effects gained, and what is `min_gain`
    [nats].
    """
    known = [
        tried.likelihood_gain.penalised for tried in selection.accepted if tried.likelihood_gain
    ]
    return free_disturbance_gain(model_set, selection) > max(
        min_gain, MAX_REMAINING_FRACTION * sum(known)
    )


def free_disturbance_gain(model_set: ModelSet, selection: Selection) -> float:
    """Return what drifts that are let free in all balances and elements gain [nats], the parameters
    fitted with them; those of elements are left out where they do not go along.

    An effect that may walk along a recording, such as a grade, leaves what it leaves at its place.
    A free error of an output is none of them: a sensor follows whatever the model gets wrong.
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
    """Return what some drifts gain [nats] that are let free; -inf where they do not go along."""
    held = {
        tried.placed_effect.place
        for tried in selection.accepted
        if varies_slowly(tried.placed_effect)
    }
    gain = disturbance_gain(model_set, selection.model, disturbances, held)
    return gain / integrated_autocorrelation(selection.model, model_set.series)


def has_autocorrelated_residuals(model_set: ModelSet, selection: Selection) -> bool:
    """Tell whether innovations remember much of what they did before effects were accepted."""
    before, after = (
        integrated_autocorrelation(one, model_set.series)
        for one in (selection.base, selection.model)
    )
    return after > MIN_AUTOCORRELATION and after - 1.0 > MAX_AUTOCORRELATION_RATIO * (before - 1.0)


def has_autocorrelated_residuals_in_most(model_set: ModelSet, selection: Selection) -> bool:
    """Tell whether innovations remember, and those of most recordings in which they did before.

    Where a form is not quite right some recordings show it that drive it far.
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
    """Tell whether an effect needed another one at its place, which gains much of what it gained:
    together they imitate what is neither.
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
    """Tell whether effects that gained little leave simulations nearly as they were."""
    gained = sum(
        tried.likelihood_gain.penalised for tried in selection.accepted if tried.likelihood_gain
    )
    if gained > SMALL_GAIN:
        return False
    before, after = (nrmse(one, model_set.series) for one in (selection.base, selection.model))
    return float(np.mean(after / np.maximum(before, 1e-12))) > MIN_MISFIT_RATIO


def reject_effects(selection: Selection) -> Selection:
    """Return a selection in which nothing was accepted, and no candidate is likely."""
    totals = [
        tried.likelihood_gain.total for tried in selection.first_round if tried.likelihood_gain
    ]
    other = max(selection.other, *totals) + REJECTION_LEAD
    return dataclasses.replace(selection, model=selection.base, accepted=(), rivals=(), other=other)
