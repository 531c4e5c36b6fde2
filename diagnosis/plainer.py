"""Plainer: an effect that may as well be a plainer one gives way to that one.

Friction that rises at rest is dry friction where its rise is none. With more numbers it explains a
few nats more of what is left of any form.
"""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.estimation import Estimate
from diagnosis.evidence import inflation
from diagnosis.layers import Layer
from diagnosis.naming import covariance_of, place_path
from diagnosis.search import Tried
from diagnosis.series import Series
from language.effect import own_names

PLAINLY = 5.0
"""Nats that the recordings must tell an effect from what it is where it is a plainer one."""
NEARLY = 0.9
"""Part of what it gained that the plainer one gains at least."""


def plainest(best: Tried, tried: Sequence[Tried], series: Sequence[Series]) -> Tried:
    """Return a candidate at the place of the best one that is what that one may as well be."""
    if best.estimate is None or best.evidence is None:
        return best
    if not may_be_plainer(best.estimate, best.layer, series):
        return best
    for other in tried:
        if other.evidence is None or place_path(other.layer) != place_path(best.layer):
            continue
        if _numbers(other) < _numbers(best) and other.evidence.train > NEARLY * best.evidence.train:
            return other
    return best


def may_be_plainer(model: Estimate, layer: Layer, series: Sequence[Series]) -> bool:
    """Tell whether an effect that a model holds may as well be a plainer one."""
    if model.normal is None:
        return False
    covariance, names = covariance_of(model)
    shrink = 1.0 / inflation(model, series)
    brought = {layer.named(name) for name in own_names(layer.effect.body)}
    for one, z in zip(model.candidate.uncertain, model.point.shared, strict=True):
        if one.name in brought and one.plain is not None and not one.per_recording:
            k = names.index(one.name)
            apart = float(z) - one.coordinate(one.plain)
            if shrink * apart**2 / (2.0 * covariance[k, k]) < PLAINLY:
                return True
    return False


def _numbers(tried: Tried) -> int:
    return len(list(own_names(tried.layer.effect.body)))
