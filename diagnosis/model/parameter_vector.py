"""Parameter vectors: coordinates of a candidate's free parameters, shared and per recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.model.candidate import Candidate


@dataclass(frozen=True)
class ParameterVector:
    """Coordinates `shared` (parameters,) and `per_recording` (recordings, parameters)."""

    shared: Reals
    per_recording: Reals

    def perturb(self, candidate: Candidate, index: int, size: float) -> ParameterVector:
        """Return a vector with coordinate `index` increased by `size`, or decreased at its bound.

        The coordinate changes in the shared array and for every recording.
        """
        high = bounds_of(candidate)[index, 1]
        size = size if self.shared[index] + size <= high else -size
        shared, own = self.shared.copy(), self.per_recording.copy()
        shared[index] += size
        own[:, index] += size
        return ParameterVector(shared, own)

    def prior_cost(self, candidate: Candidate) -> float:
        """Return the negative log density [nats] of the prior, but for a constant."""
        own = per_recording_mask(candidate)
        return 0.5 * float((self.shared[~own] ** 2).sum() + (self.per_recording[:, own] ** 2).sum())


def vector_of(candidate: Candidate, recordings: int, start: Mapping[str, float]) -> ParameterVector:
    """Return the vector of given values [SI], clipped to the bounds, for all recordings.

    Parameters not in `start` have their first start value, or else their declared value.
    """
    shared = [
        one.coordinate(start.get(one.name, one.starts[0] if one.starts else one.start))
        for one in candidate.free_parameters
    ]
    bounds = bounds_of(candidate)
    z = np.clip(np.array(shared, dtype=float), bounds[:, 0], bounds[:, 1])
    return ParameterVector(z, np.tile(z, (recordings, 1)))


def extend_vector(
    candidate: Candidate,
    base: Candidate,
    base_point: ParameterVector,
    start: Mapping[str, float] | ParameterVector,
) -> ParameterVector:
    """Return the vector of a candidate with the coordinates of `base_point` where names agree.

    Other parameters are at `start`: values [SI] as in `vector_of`, or a vector of the candidate.
    """
    point = start
    if not isinstance(point, ParameterVector):
        point = vector_of(candidate, len(base_point.per_recording), point)
    point = ParameterVector(point.shared.copy(), point.per_recording.copy())
    names = candidate.names
    for k, name in enumerate(base.names):
        if name in names:
            point.shared[names.index(name)] = base_point.shared[k]
            point.per_recording[:, names.index(name)] = base_point.per_recording[:, k]
    return point


def values_at(candidate: Candidate, point: ParameterVector, recording: int) -> dict[str, float]:
    """Return the values [SI] of the free parameters by name for one recording (its index)."""
    return {
        one.name: one.value(
            float(point.per_recording[recording, k] if one.per_recording else point.shared[k])
        )
        for k, one in enumerate(candidate.free_parameters)
    }


def all_values_at(candidate: Candidate, point: ParameterVector) -> list[dict[str, float]]:
    """Return the values [SI] by name for every recording; one dict if all are shared."""
    shared, recordings = values_at(candidate, point, 0), range(len(point.per_recording))
    own = [(k, one) for k, one in enumerate(candidate.free_parameters) if one.per_recording]
    if not own:
        return [shared for _ in recordings]
    return [
        {**shared, **{one.name: one.value(float(point.per_recording[r, k])) for k, one in own}}
        for r in recordings
    ]


def per_recording_mask(candidate: Candidate) -> NDArray[np.bool_]:
    """Return the mask (parameters,) of free parameters with a value for each recording."""
    return candidate.is_per_recording


def bounds_of(candidate: Candidate) -> Reals:
    """Return the bounds of the free parameters as coordinates (parameters, 2)."""
    return candidate.bounds
