"""Point: where the parameters of a candidate are, in coordinates, for some recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.model.candidate import Candidate

Reals = NDArray[np.float64]


@dataclass(frozen=True)
class ParameterVector:
    """Coordinates: `shared` (parameters,), and `own` (recordings, parameters) of those per one.

    A parameter has its place in both; only one of them counts.
    """

    shared: Reals
    per_recording: Reals

    def perturb(self, candidate: Candidate, index: int, size: float) -> ParameterVector:
        """Return a point with one coordinate moved, down where up is out of its range."""
        high = bounds_of(candidate)[index, 1]
        size = size if self.shared[index] + size <= high else -size
        shared, own = self.shared.copy(), self.per_recording.copy()
        shared[index] += size
        own[:, index] += size
        return ParameterVector(shared, own)

    def prior_cost(self, candidate: Candidate) -> float:
        """Return half the squares of the coordinates that count [nats]."""
        own = per_recording_mask(candidate)
        return 0.5 * float((self.shared[~own] ** 2).sum() + (self.per_recording[:, own] ** 2).sum())


def vector_of(candidate: Candidate, recordings: int, start: Mapping[str, float]) -> ParameterVector:
    """Return the point of some values [SI]; the others start where they are declared."""
    shared = []
    for one in candidate.free_parameters:
        value = start.get(one.name, one.starts[0] if one.starts else one.start)
        shared.append(one.coordinate(value))
    bounds = bounds_of(candidate)
    z = np.clip(np.array(shared, dtype=float), bounds[:, 0], bounds[:, 1])
    return ParameterVector(z, np.tile(z, (recordings, 1)))


def extend_vector(
    candidate: Candidate,
    base: Candidate,
    base_point: ParameterVector,
    start: Mapping[str, float] | ParameterVector,
) -> ParameterVector:
    """Return the point of a candidate that stands where a base does `base_point` a point of its own.

    What the base does not have is at `start`: values [SI], or a point of the candidate.
    """
    point = (
        start
        if isinstance(start, ParameterVector)
        else vector_of(candidate, len(base_point.per_recording), start)
    )
    point = ParameterVector(point.shared.copy(), point.per_recording.copy())
    names = candidate.names
    for k, name in enumerate(base.names):
        if name in names:
            point.shared[names.index(name)] = base_point.shared[k]
            point.per_recording[:, names.index(name)] = base_point.per_recording[:, k]
    return point


def values_at(candidate: Candidate, point: ParameterVector, recording: int) -> dict[str, float]:
    """Return the parameters [SI] of a recording."""
    return {
        one.name: one.value(
            float(point.per_recording[recording, k] if one.per_recording else point.shared[k])
        )
        for k, one in enumerate(candidate.free_parameters)
    }


def all_values_at(candidate: Candidate, point: ParameterVector) -> list[dict[str, float]]:
    """Return the parameters [SI] of every recording; one that all share is made once."""
    shared, recordings = values_at(candidate, point, 0), range(len(point.per_recording))
    own = [(k, one) for k, one in enumerate(candidate.free_parameters) if one.per_recording]
    if not own:
        return [shared for _ in recordings]
    return [
        {**shared, **{one.name: one.value(float(point.per_recording[r, k])) for k, one in own}}
        for r in recordings
    ]


def per_recording_mask(candidate: Candidate) -> NDArray[np.bool_]:
    """Return which parameters each recording has of its own (parameters,)."""
    return candidate.is_per_recording


def bounds_of(candidate: Candidate) -> Reals:
    """Return the ranges as coordinates (parameters, 2)."""
    return candidate.bounds
