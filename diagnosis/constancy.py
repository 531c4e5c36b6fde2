"""Constancy: whether the parameters of an effect are the same in each recording.

Physics is: a constant of a machine does not change with the manoeuvre. What imitates an effect that
the library lacks finds another value in each that comes nearest to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.estimate import Estimate
from diagnosis.evidence import inflation
from diagnosis.layers import Layer
from diagnosis.naming import brought_by
from diagnosis.search import Tried
from diagnosis.series import Series

VARIED, VARIED_PART = 20.0, 0.012
"""Nats that values of its own in each recording would gain for an effect, and part of what it
gained, from which on its parameters vary."""
OTHER_PART = 0.2
"""The same part from which on they are no constants of a machine: right ones have 0.15 at most."""


def differs(model: Estimate, tried: Tried, series: Sequence[Series]) -> bool:
    """Tell whether they differ so much that the effect is another one."""
    gained = tried.evidence.train if tried.evidence else 0.0
    return variation(model, tried.layer, series) > max(VARIED, OTHER_PART * gained)


def varies(model: Estimate, tried: Tried, series: Sequence[Series]) -> bool:
    """Tell whether the parameters of an effect that a model holds are not the same in each."""
    gained = tried.evidence.train if tried.evidence else 0.0
    return variation(model, tried.layer, series) > max(VARIED, VARIED_PART * gained)


def variation(model: Estimate, layer: Layer, series: Sequence[Series]) -> float:
    """Return what values of their own in each recording would gain [nats] for the parameters of an
    effect, beyond what noise gives them: the normal equations foresee it, all else held.

    (The score test of Rao 1948, of parameters that are the same against some that are not.)
    """
    if model.normal is None:
        return 0.0
    brought = brought_by(layer)
    is_brought = np.array([name in brought for name in model.candidate.names], dtype=bool)
    own = np.flatnonzero(is_brought & ~model.normal.own)
    shrink, found = 1.0 / inflation(model, series), 0.0
    for recording in np.unique(model.normal.of):
        here = model.normal.of == recording
        known = shrink * model.normal.a[here].sum(axis=0)[np.ix_(own, own)]
        slope = shrink * model.normal.g[here].sum(axis=0)[own]
        whole = known + np.eye(len(own))
        by_chance = float(np.trace(np.linalg.solve(whole, known)))
        found += 0.5 * (float(slope @ np.linalg.solve(whole, slope)) - by_chance)
    return found
