"""Constancy: whether the parameters of an effect are the same in each recording.

Physics is: a constant of a machine does not change with the manoeuvre. What imitates an effect that
the library lacks finds another value in each that comes nearest to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.estimate import Estimate
from diagnosis.evidence import inflation
from diagnosis.layers import SECONDS, Layer
from diagnosis.naming import brought_by
from diagnosis.search import Tried
from diagnosis.series import Series
from language.document import Scalar, Table
from language.units import parse_unit

VARIED, VARIED_PART = 20.0, 0.012
"""Nats that values of its own in each recording would gain for an effect, and part of what it
gained, from which on its parameters vary."""
OTHER_PART, LATE_PART = 0.2, 0.025
"""The same part from which on they are no constants of a machine: right ones have 0.17 at most. A
lag or a delay alone has 0.01 (one of thirty had 0.03): nothing beside it makes its time another."""


def differs(model: Estimate, tried: Tried, series: Sequence[Series], is_alone: bool) -> bool:
    """Tell whether they differ so much that the effect is another one."""
    part = LATE_PART if is_alone and comes_late(tried.layer) else OTHER_PART
    return variation(model, tried.layer, series) > max(VARIED, part * tried.gained)


def comes_late(layer: Layer) -> bool:
    """Tell whether an effect is a lag or a delay: it has a time, without which it is absent."""
    known = layer.effect.body.get("parameters")
    entries = known if isinstance(known, Table) else ()
    return any(isinstance(one.node, Table) and _is_absent_time(one.node) for one in entries)


def _is_absent_time(parameter: Table) -> bool:
    neutral, value = parameter.get("neutral"), parameter.get("value")
    if not isinstance(neutral, Scalar) or not isinstance(value, Scalar) or neutral.text != "absent":
        return False
    unit = value.text.partition(" ")[2]
    return bool(unit) and parse_unit(unit).dimension.powers == SECONDS


def varies(model: Estimate, tried: Tried, series: Sequence[Series]) -> bool:
    """Tell whether the parameters of an effect that a model holds are not the same in each."""
    return variation(model, tried.layer, series) > max(VARIED, VARIED_PART * tried.gained)


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
