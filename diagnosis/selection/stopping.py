"""Stopping rule: an upper bound of the gain of further effects, from free disturbances.

A disturbance follows any error at its place with a delay. If the present disturbances are small,
and free ones gain little, no effect does.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.estimation.estimate import Estimate, evaluate_near
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_covariance import fit_noise_covariance
from diagnosis.estimation.noise_level import disturbance_units
from diagnosis.localisation.ranking import disturbance_locations
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.model.placed_effect import DISTURBANCE_STATE, PlacedEffect
from language.text.diagnostic import SpecError

FREE_LEVEL = 1000.0
"""Units that such a drift may have."""
MAX_AUTOCORRELATION = 1.6
"""Innovations that count as one from which on a model may be so far astray that drifts which are
let free do not find their way."""
MAX_DISTURBANCE_LEVEL = 0.5
"""Units of a drift from which on it may stand for an effect: free ones then gain nothing more, and
the effect gains what it explains better."""


def meets_stopping_rule(
    model_set: ModelSet, model: Estimate, units: Mapping[str, float], min_gain: float
) -> bool:
    """Return whether a further effect cannot gain `min_gain` [nats].

    Free disturbances that lose much have not converged and show nothing.
    """
    drifts = model.noise_levels.process
    is_low = all(
        drifts.get(name, 0.0) < MAX_DISTURBANCE_LEVEL * unit for name, unit in units.items()
    )
    if not is_low or integrated_autocorrelation(model, model_set.series) >= MAX_AUTOCORRELATION:
        return False
    return abs(further_gain_bound(model_set, model)) < min_gain


def further_gain_bound(model_set: ModelSet, model: Estimate) -> float:
    """Return the gain [nats] of free disturbances in balances, elements and outputs.

    Places of effects are left out if the model with disturbances there has no finite cost; the
    bound is infinite if it still has none.
    """
    inside = [
        placed_effect
        for section, placed_effect in disturbance_locations(model_set)
        if section != "flow"
    ]
    taken = {placed_effect.place for placed_effect in model.candidate.placed_effects}
    beside = [placed_effect for placed_effect in inside if placed_effect.place not in taken]
    gains = (
        disturbance_gain(model_set, model, (*model_set.disturbances, *some))
        for some in (inside, beside)
    )
    return next((gain for gain in gains if np.isfinite(gain)), np.inf)


def disturbance_gain(
    model_set: ModelSet,
    model: Estimate,
    disturbances: Sequence[PlacedEffect],
    fixed_places: Collection[str] = (),
) -> float:
    """Return the gain [nats] of free disturbances, except at `fixed_places`;
    -inf if not compilable.
    """
    try:
        candidate = model_set.compile_candidate(model.candidate.placed_effects, disturbances)
    except SpecError:
        return -np.inf
    units = disturbance_units(candidate, model_set.series, model.values(0))
    most = {
        placed_effect.qualified_name(DISTURBANCE_STATE): FREE_LEVEL
        for placed_effect in disturbances
        if placed_effect.place not in fixed_places
    }
    point = extend_vector(candidate, model.candidate, model.point, {})
    quiet = evaluate_near(candidate, model_set.series, model.noise_levels, point, model)
    found = fit_noise_covariance(quiet, model_set.series, units, most)
    return model.cost - found.cost
