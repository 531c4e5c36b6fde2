"""Strain: what effects would gain beyond the ranges of their own parameters.

What imitates another effect is pulled out of the ranges that its own physics has.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate
from diagnosis.normal import solution
from diagnosis.point import bounds_of
from diagnosis.search import Tried
from language.effect import own_names

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
    brought = {
        tried.layer.named(name) for tried in accepted for name in own_names(tried.layer.effect.body)
    }
    low, high = bounds_of(model.candidate).T
    at_end = (model.point.shared <= low) | (model.point.shared >= high)
    is_brought = np.array([name in brought for name in model.candidate.names], dtype=bool)
    within = ~model.normal.own & ~at_end
    beyond = ~model.normal.own & (is_brought | ~at_end)
    return _foreseen(model, beyond) - _foreseen(model, within)


def _foreseen(model: Estimate, free: NDArray[np.bool_]) -> float:
    """Return what a step of the free shared coordinates (parameters,) gains, without ranges."""
    assert model.normal is not None
    slope = model.normal.g.sum(axis=0)[free] + model.point.shared[free]
    matrix = model.normal.a.sum(axis=0)[np.ix_(free, free)] + np.eye(int(free.sum()))
    return 0.5 * float(slope @ solution(matrix, slope))
