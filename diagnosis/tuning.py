"""Tuning: levels of drifts and noises found together with the parameters, in one least squares.

What an observer trusts in and what a model says hang together: found in turns they end where
neither gains without the other, hundreds of nats from where both are better.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_at
from diagnosis.estimation import completed
from diagnosis.point import Point
from diagnosis.prediction import DRIFTS, INPUTS, SIGNAL, Noises, noises_at, noises_of
from diagnosis.series import Series
from diagnosis.uncertain import Uncertain

LEAST, MOST = 0.03, 3.0
"""Standard deviations that a drift may have, in its unit, while effects are named."""
NOTHING_MORE: Mapping[str, float] = {}
FARTHEST = 2.5
"""Factor by which a noise may be another one than was measured."""
DRIFT_PRIOR, NOISE_PRIOR = 2.0, 0.5
"""Standard deviations of their logarithms: of drifts next to nothing is known."""


def tuned(
    now: Estimate,
    series: Sequence[Series],
    units: Mapping[str, float],
    most: Mapping[str, float] = NOTHING_MORE,
) -> Estimate:
    """Return a fit with its parameters and the levels of its noises where both foresee best.

    Only drifts that have a unit are moved, to three of these or to the `most` that is given. What
    feeds nothing back has no gain: its noises stay.
    """
    if now.noises.is_alone or not np.isfinite(now.cost):
        return completed(now, series)
    known = noises_of(series, {})
    levels = tuple(_levels(now.candidate, known, units, most))
    wide = dataclasses.replace(now.candidate, levels=levels)
    point = _widened(wide, now)
    noises = noises_at(wide, point, now.noises)
    begun = looked_at(wide, series, noises, point, now.outcome)
    if not np.isfinite(begun.cost):
        return completed(now, series)
    found = _narrowed(now.candidate, completed(begun, series))
    return found if found.cost < now.cost else completed(now, series)


def _levels(
    candidate: Candidate, known: Noises, units: Mapping[str, float], most: Mapping[str, float]
) -> Iterator[Uncertain]:
    """Yield the levels of a candidate that a fit may move, near what is known of them."""
    for name, unit in units.items():
        middle = unit * np.sqrt(LEAST * MOST)
        high = most.get(name, MOST) * unit
        yield _level(DRIFTS.format(name), middle, LEAST * unit, high, DRIFT_PRIOR)
    noises = {
        SIGNAL.format(n): v for n, v in zip(candidate.predictor.seen, known.seen, strict=True)
    }
    noises[INPUTS] = float(np.max(known.inputs, initial=0.0))
    for name, noise in noises.items():
        if noise > 0.0:
            yield _level(name, noise, noise / FARTHEST, noise * FARTHEST, NOISE_PRIOR)


def _level(name: str, value: float, low: float, high: float, prior: float) -> Uncertain:
    return Uncertain(name, float(value), float(low), float(high), prior, True)


def _widened(wide: Candidate, now: Estimate) -> Point:
    """Return the point of an estimate with its levels behind its parameters."""
    noises = now.noises
    values = {DRIFTS.format(name): level for name, level in noises.drifts.items()}
    seen = zip(wide.predictor.seen, noises.seen, strict=True)
    values |= {SIGNAL.format(name): float(noise) for name, noise in seen}
    values[INPUTS] = float(np.max(noises.inputs, initial=0.0))
    z = np.array([
        one.coordinate(min(max(values.get(one.name, 0.0), one.low), one.high))
        for one in wide.levels
    ])  # fmt: skip
    own = np.tile(z, (len(now.point.own), 1))
    return Point(np.append(now.point.shared, z), np.hstack([now.point.own, own]))


def _narrowed(candidate: Candidate, wide: Estimate) -> Estimate:
    """Return an estimate in which levels are no coordinates any more."""
    count = len(candidate.uncertain)
    point = Point(wide.point.shared[:count].copy(), wide.point.own[:, :count].copy())
    columns = {name: wide.columns[name] for name in candidate.names}
    normal = wide.normal and dataclasses.replace(
        wide.normal,
        a=np.ascontiguousarray(wide.normal.a[:, :count, :count]),
        g=np.ascontiguousarray(wide.normal.g[:, :count]),
        own=wide.normal.own[:count],
    )
    cost = wide.outcome.cost() + point.prior(candidate)
    return dataclasses.replace(
        wide, candidate=candidate, point=point, cost=cost, normal=normal, columns=columns
    )
