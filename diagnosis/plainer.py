"""Plainer: an effect that may as well be a plainer one gives way to that one.

Friction that rises at rest is dry friction where its rise is none. With more numbers it explains a
few nats more of what is left of any form.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

from diagnosis.estimate import Estimate
from diagnosis.evidence import inflation
from diagnosis.layers import Layer
from diagnosis.naming import brought_by, covariance_of, place_path
from diagnosis.search import Tried
from diagnosis.series import Series
from language.document import Table

PLAINLY = 5.0
"""Nats that the recordings must tell an effect from what it is where it is a plainer one."""
PLAINER_PART = 0.7
"""Part of what it gained that the plainer one gains at least."""
AHEAD = 4.0
"""Nats of score by which the plainer one then leads: odds of seven to one."""


def plainer_ones(best: Tried, tried: Sequence[Tried]) -> Iterator[Tried]:
    """Yield the candidates that one which may be plainer may be: at its place, with fewer numbers,
    that gained nearly as much.
    """
    if best.estimate is None or best.evidence is None or not has_plain(best.layer):
        return
    for other in tried:
        if other.evidence is None or place_path(other.layer) != place_path(best.layer):
            continue
        least = PLAINER_PART * best.evidence.train
        if _numbers(other) < _numbers(best) and other.evidence.train > least:
            yield other


def led_by(first: Tried, tried: Sequence[Tried]) -> tuple[Tried, list[Tried]]:
    """Return the candidate that others gave way to, and all with it, best first: it leads those at
    its place.
    """
    path = place_path(first.layer)
    others = [t for t in tried if t.layer.id != first.layer.id]
    beside = [t.score for t in others if place_path(t.layer) == path]
    behind = max(beside, default=-math.inf) + AHEAD - first.score
    lead = dataclasses.replace(first, lead=max(0.0, behind))
    return lead, sorted([lead, *others], key=lambda one: -one.score)


def may_be_plainer(model: Estimate, layer: Layer, series: Sequence[Series]) -> bool:
    """Tell whether an effect that a model holds may as well be a plainer one."""
    if model.normal is None:
        return False
    covariance, names = covariance_of(model)
    shrink = 1.0 / inflation(model, series)
    for k, plain in _plain_ones(model, layer).items():
        apart = float(model.point.shared[k]) - plain
        place = names.index(model.candidate.names[k])
        if shrink * apart**2 / (2.0 * covariance[place, place]) < PLAINLY:
            return True
    return False


def has_plain(layer: Layer) -> bool:
    """Tell whether an effect is a plainer one at some value of one of its parameters."""
    known = layer.effect.body.get("parameters")
    entries = known if isinstance(known, Table) else ()
    return any(isinstance(one.node, Table) and "plain" in one.node.entries for one in entries)


def _plain_ones(model: Estimate, layer: Layer) -> dict[int, float]:
    """Return the coordinates at which an effect is a plainer one, by their places."""
    brought = brought_by(layer)
    return {
        k: one.coordinate(one.plain)
        for k, one in enumerate(model.candidate.uncertain)
        if one.name in brought and one.plain is not None and not one.per_recording
    }


def _numbers(tried: Tried) -> int:
    return len(brought_by(tried.layer))
