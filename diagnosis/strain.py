"""Strain: what effects would gain beyond the ranges of their own parameters.

What imitates another effect is pulled out of the ranges that its own physics has.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate
from diagnosis.layers import Layer
from diagnosis.naming import brought_by, place_path
from diagnosis.normal import solution
from diagnosis.point import bounds_of
from diagnosis.rival import NEARLY
from diagnosis.search import Tried

STRAINED, STRAINED_PART = 60.0, 0.03
"""Nats that accepted effects would gain beyond the ranges of their own parameters, and part of what
they gained, from which on they are pulled out of these: what imitates another effect is."""


def is_strained(model: Estimate, accepted: Sequence[Tried]) -> bool:
    """Tell whether accepted effects are pulled out of the ranges of their own parameters."""
    gained = sum(tried.evidence.train for tried in accepted if tried.evidence)
    return strain(model, accepted) > max(STRAINED, STRAINED_PART * gained)


def strain(model: Estimate, accepted: Sequence[Tried]) -> float:
    """Return what accepted effects would gain [nats] if their own parameters that are at the end of
    a range had none, as the normal equations foresee it.
    """
    if model.normal is None:
        return 0.0
    brought = {name for tried in accepted for name in brought_by(tried.layer)}
    low, high = bounds_of(model.candidate).T
    at_end = (model.point.shared <= low) | (model.point.shared >= high)
    is_brought = np.array([name in brought for name in model.candidate.names], dtype=bool)
    within = ~model.normal.own & ~at_end
    beyond = ~model.normal.own & (is_brought | ~at_end)
    return _foreseen(model, beyond) - _foreseen(model, within)


def within_range(best: Tried, tried: Sequence[Tried]) -> Tried:
    """Return the best candidate, or where it is at a limit one at its place that is at none and
    gains nearly as much.
    """
    if best.evidence is None or not is_at_limit(best.estimate, best.layer):
        return best
    least = NEARLY * best.evidence.train
    near = (t for t in tried if t.evidence and t.evidence.train >= least)
    beside = (t for t in near if place_path(t.layer) == place_path(best.layer))
    return next((t for t in beside if not is_at_limit(t.estimate, t.layer)), best)


def is_at_limit(model: Estimate | None, layer: Layer) -> bool:
    """Tell whether a parameter of an effect is at an end of its range that was set to it: nothing
    ends a quantity but zero, and one where it is a share.
    """
    if model is None:
        return False
    brought = brought_by(layer)
    return any(
        (z <= low and one.low != 0.0) or (z >= high and (one.high, one.unit) != (1.0, "1"))
        for one, z, (low, high) in zip(
            model.candidate.uncertain, model.point.shared, bounds_of(model.candidate), strict=True
        )
        if one.name in brought and not one.per_recording
    )


def _foreseen(model: Estimate, free: NDArray[np.bool_]) -> float:
    """Return what a step of the free shared coordinates (parameters,) gains, without ranges."""
    assert model.normal is not None
    slope = model.normal.g.sum(axis=0)[free] + model.point.shared[free]
    matrix = model.normal.a.sum(axis=0)[np.ix_(free, free)] + np.eye(int(free.sum()))
    return 0.5 * float(slope @ solution(matrix, slope))
