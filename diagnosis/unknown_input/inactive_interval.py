"""Inactive intervals: parameters estimated where an unknown input does not act.

An input that is free everywhere also absorbs the error of a wrong mass or drag.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate, evaluate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.noise_level import ORDINARY_LEVEL, disturbance_units
from diagnosis.localisation.disturbance_state_fit import (
    ALL_LEVELS,
    scan_level,
    with_disturbance_levels,
)
from diagnosis.model.parameter_vector import ParameterVector

Booleans = NDArray[np.bool_]
MARGIN = 2.5
"""Reference times before and after an active interval that do not count as inactive."""
MIN_DURATION = 10.0
"""Shortest inactive interval, in reference times; the observer must find the states in it."""
MIN_INACTIVE_FRACTION = 1.0 / 3.0
"""Smallest fraction of the samples that is inactive, for parameters to follow from it."""


def refit_on_inactive_intervals(
    model: Estimate, series: Sequence[SampledRecording], active: Sequence[Booleans], name: str
) -> Estimate:
    """Return a model with the disturbance `name` free, fitted on its inactive intervals.

    `active` (samples,) of each recording begins after its burn-in. The model is returned unchanged
    if the intervals are too short.
    """
    pieces, places = _inactive_recordings(series, active)
    if sum(one.count for one in pieces) < MIN_INACTIVE_FRACTION * sum(one.count for one in series):
        return model
    units = disturbance_units(model.candidate, series, model.values(0))
    recording_indices = [places.index(r) if r in places else 0 for r in range(len(series))]
    start = ParameterVector(model.point.shared, model.point.per_recording[places])
    ordinary = with_disturbance_levels(
        model.noise_levels, units, dict.fromkeys(units, ORDINARY_LEVEL)
    )
    best = estimate_parameters(model.candidate, pieces, ordinary, start)
    point = ParameterVector(best.point.shared, best.point.per_recording[recording_indices])
    free = evaluate(model.candidate, series, ordinary, point)
    return scan_level(free, series, units, name, ALL_LEVELS)


def _inactive_recordings(
    series: Sequence[SampledRecording], active: Sequence[Booleans]
) -> tuple[list[SampledRecording], list[int]]:
    """Return inactive intervals, the longest first, and the index of their recordings."""
    found = []
    for r, (one, there) in enumerate(zip(series, active, strict=True)):
        around = np.ones(2 * one.sample_count(MARGIN) + 1)
        near = (
            np.convolve(np.pad(there, (burn_in_samples(one), 0)).astype(float), around, "same")
            > 0.5
        )
        found += [(part, r) for part in _inactive_parts(one, near)]
    found.sort(key=lambda pair: -pair[0].count)
    return [part for part, _ in found], [r for _, r in found]


def _inactive_parts(series: SampledRecording, active: Booleans) -> list[SampledRecording]:
    """Return the inactive parts of a recording; each begins where all outputs are measured."""
    edges = [0, *(np.flatnonzero(np.diff(active)) + 1).tolist(), series.count]
    known = np.flatnonzero(np.all(np.isfinite(series.measured), axis=1))
    found = []
    for low, high in pairwise(edges):
        first = known[np.searchsorted(known, low) :][:1]
        if not active[low] and len(first) and high - first[0] >= series.sample_count(MIN_DURATION):
            part = slice(int(first[0]), high)
            found.append(
                dataclasses.replace(
                    series,
                    start=series.start + series.period * part.start,
                    inputs=np.ascontiguousarray(series.inputs[part]),
                    measured=np.ascontiguousarray(series.measured[part]),
                )
            )
    return found
