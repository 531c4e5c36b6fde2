"""Point: where the parameters of a candidate are, in coordinates, for some recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidate import Candidate

Reals = NDArray[np.float64]


@dataclass(frozen=True)
class Point:
    """Coordinates: `shared` (parameters,), and `own` (recordings, parameters) of those per one.

    A parameter has its place in both; only one of them counts.
    """

    shared: Reals
    own: Reals

    def moved(self, candidate: Candidate, k: int, size: float) -> Point:
        """Return a point with one coordinate moved, down where up is out of its range."""
        high = bounds_of(candidate)[k, 1]
        size = size if self.shared[k] + size <= high else -size
        shared, own = self.shared.copy(), self.own.copy()
        shared[k] += size
        own[:, k] += size
        return Point(shared, own)

    def prior(self, candidate: Candidate) -> float:
        """Return half the squares of the coordinates that count [nats]."""
        own = is_own(candidate)
        return 0.5 * float((self.shared[~own] ** 2).sum() + (self.own[:, own] ** 2).sum())


def point_of(candidate: Candidate, recordings: int, start: Mapping[str, float]) -> Point:
    """Return the point of some values [SI]; the others start where they are declared."""
    shared = []
    for one in candidate.uncertain:
        value = start.get(one.name, one.starts[0] if one.starts else one.start)
        shared.append(one.coordinate(value))
    bounds = bounds_of(candidate)
    z = np.clip(np.array(shared, dtype=float), bounds[:, 0], bounds[:, 1])
    return Point(z, np.tile(z, (recordings, 1)))


def extended(
    candidate: Candidate, base: Candidate, at: Point, start: Mapping[str, float] | Point
) -> Point:
    """Return the point of a candidate that stands where a base does `at` a point of its own.

    What the base does not have is at `start`: values [SI], or a point of the candidate.
    """
    point = start if isinstance(start, Point) else point_of(candidate, len(at.own), start)
    point = Point(point.shared.copy(), point.own.copy())
    names = candidate.names
    for k, name in enumerate(base.names):
        if name in names:
            point.shared[names.index(name)] = at.shared[k]
            point.own[:, names.index(name)] = at.own[:, k]
    return point


def values_at(candidate: Candidate, point: Point, recording: int) -> dict[str, float]:
    """Return the parameters [SI] of a recording."""
    return {
        one.name: one.value(
            float(point.own[recording, k] if one.per_recording else point.shared[k])
        )
        for k, one in enumerate(candidate.uncertain)
    }


def all_values_at(candidate: Candidate, point: Point) -> list[dict[str, float]]:
    """Return the parameters [SI] of every recording; one that all share is made once."""
    shared, recordings = values_at(candidate, point, 0), range(len(point.own))
    own = [(k, one) for k, one in enumerate(candidate.uncertain) if one.per_recording]
    if not own:
        return [shared for _ in recordings]
    return [
        {**shared, **{one.name: one.value(float(point.own[r, k])) for k, one in own}}
        for r in recordings
    ]


def is_own(candidate: Candidate) -> NDArray[np.bool_]:
    """Return which parameters each recording has of its own (parameters,)."""
    return candidate.own


def bounds_of(candidate: Candidate) -> Reals:
    """Return the ranges as coordinates (parameters, 2)."""
    return candidate.bounds
