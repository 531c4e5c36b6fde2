"""Bound score: the gain of accepted effects if their parameters could leave their ranges.

An effect that imitates another one is driven out of its own physical ranges.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.normal_equations import solve
from diagnosis.model.parameter_vector import bounds_of
from diagnosis.model.placed_effect import PlacedEffect, effect_names, place_path
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.confusion_set import CONFUSION_FRACTION

MIN_SCORE, MIN_SCORE_FRACTION = 60.0, 0.03
"""Nats that accepted effects would gain beyond the ranges of their own parameters, and part of what
they gained, from which on they are pulled out of these: what imitates another effect is."""


def rejects_bounds(model: Estimate, accepted: Sequence[CandidateFit]) -> bool:
    """Return whether accepted effects would gain much beyond the ranges of their parameters."""
    gained = sum(tried.likelihood_gain.penalised for tried in accepted if tried.likelihood_gain)
    return bound_score(model, accepted) > max(MIN_SCORE, MIN_SCORE_FRACTION * gained)


def bound_score(model: Estimate, accepted: Sequence[CandidateFit]) -> float:
    """Return the predicted gain [nats] if effect parameters at a bound were free (Rao 1948).

    It is the difference of the gains of the normal equations with and without these parameters.
    """
    if model.normal_equations is None:
        return 0.0
    brought = {name for tried in accepted for name in effect_names(tried.placed_effect)}
    low, high = bounds_of(model.candidate).T
    at_end = (model.point.shared <= low) | (model.point.shared >= high)
    is_brought = np.array([name in brought for name in model.candidate.names], dtype=bool)
    within = ~model.normal_equations.own & ~at_end
    beyond = ~model.normal_equations.own & (is_brought | ~at_end)
    return _predicted_gain(model, beyond) - _predicted_gain(model, within)


def prefer_interior(best: CandidateFit, candidate_fits: Sequence[CandidateFit]) -> CandidateFit:
    """Return the best candidate, or one at its place
    that is at no bound and gains nearly as much.
    """
    if best.likelihood_gain is None or not is_at_bound(best.estimate, best.placed_effect):
        return best
    least = CONFUSION_FRACTION * best.likelihood_gain.penalised
    near = (t for t in candidate_fits if t.likelihood_gain and t.likelihood_gain.penalised >= least)
    beside = (t for t in near if place_path(t.placed_effect) == place_path(best.placed_effect))
    return next((t for t in beside if not is_at_bound(t.estimate, t.placed_effect)), best)


def is_at_bound(model: Estimate | None, placed_effect: PlacedEffect) -> bool:
    """Return whether a parameter of an effect is at a bound other than a natural one.

    Natural bounds are 0, and 1 for a fraction.
    """
    if model is None:
        return False
    brought = effect_names(placed_effect)
    return any(
        (z <= low and one.low != 0.0) or (z >= high and (one.high, one.unit) != (1.0, "1"))
        for one, z, (low, high) in zip(
            model.candidate.free_parameters,
            model.point.shared,
            bounds_of(model.candidate),
            strict=True,
        )
        if one.name in brought and not one.per_recording
    )


def _predicted_gain(model: Estimate, is_free: NDArray[np.bool_]) -> float:
    """Return what a step of the free shared coordinates (parameters,) gains, without ranges."""
    assert model.normal_equations is not None
    slope = model.normal_equations.g.sum(axis=0)[is_free] + model.point.shared[is_free]
    matrix = model.normal_equations.a.sum(axis=0)[np.ix_(is_free, is_free)] + np.eye(
        int(is_free.sum())
    )
    return 0.5 * float(slope @ solve(matrix, slope))
