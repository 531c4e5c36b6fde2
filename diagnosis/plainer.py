"""Plainer: an effect that may as well be a plainer one gives way to that one.

Friction that rises at rest is dry friction where its rise is none. With more numbers it explains a
few nats more of what is left of any form.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import evidence, inflation
from diagnosis.layers import Layer
from diagnosis.level import settled
from diagnosis.naming import brought_by, covariance_of, place_path
from diagnosis.point import extended
from diagnosis.search import Tried
from diagnosis.series import Series

PLAINLY = 5.0
"""Nats that the recordings must tell an effect from what it is where it is a plainer one."""
PLAINER_PART = 0.7
"""Part of what it gained that the plainer one gains at least."""
AHEAD = 4.0
"""Nats of score by which the plainer one then leads: odds of seven to one."""


def plainest(
    bench: Bench, base: Estimate, units: Mapping[str, float], best: Tried, tried: Sequence[Tried]
) -> Tried:
    """Return the plainer candidate that the best one gains too little over, or the best one.

    The plainer one is fitted from there as well: which one fits better is not to be an accident.
    """
    model = best.estimate
    if model is None or best.evidence is None:
        return best
    for other in plainer_ones(best, tried):
        assert other.estimate is not None
        candidate = other.estimate.candidate
        start = extended(candidate, model.candidate, model.point, other.estimate.point)
        given = (model.noises, start, units)
        make = partial(settled, candidate, bench.series, *given, like=model)
        again = bench.kept("settled", candidate, (*given, model.gains), make)
        found = min(other.estimate, again, key=lambda one: one.cost)
        known = evidence(found, base, bench.series)
        if best.evidence.train - known.train < PLAINLY:
            return dataclasses.replace(other, estimate=found, evidence=known)
    return best


def plainer_ones(best: Tried, tried: Sequence[Tried]) -> Iterator[Tried]:
    """Yield the candidates that one which may be plainer may be: at its place, with fewer numbers,
    that gained nearly as much.
    """
    if best.estimate is None or best.evidence is None or not _plain_ones(best.estimate, best.layer):
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
