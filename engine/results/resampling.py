"""Resampling: the values of the signals of a run at other times."""

from __future__ import annotations

import numpy as np

from engine.results.array_types import Reals
from engine.results.sampled_run import SignalArray
from engine.results.trajectory import Trajectory

ROUNDING_ULPS = 8
"""Rounding of the difference of two times, in units of the last place of the larger one."""


def resample_signal(trajectory: Trajectory, name: str, times: Reals) -> Reals:
    """Return a signal at times [s] (n,), as floats.

    Reals are interpolated linearly; integers and signals that are `piecewise_constant` have the
    value of the last sample up to each time. Before the first and after the last sample the nearest
    one holds. Samples at equal times are returned as they are.
    """
    values = trajectory.signals[name]
    if trajectory.times.tobytes() == times.tobytes():
        return values.astype(np.float64)
    if values.dtype == np.int64 or name in trajectory.piecewise_constant:
        return hold_previous(trajectory.times, values, times).astype(np.float64)
    with np.errstate(invalid="ignore"):
        resampled: Reals = np.interp(times, trajectory.times, values)
    return resampled


def hold_previous(sample_times: Reals, values: SignalArray, times: Reals) -> SignalArray:
    """Return the values of the last sample up to each time; the first value before it.

    Times that differ by rounding only are equal.
    """
    largest = max(np.max(np.abs(sample_times), initial=0.0), np.max(np.abs(times), initial=0.0))
    rounding = ROUNDING_ULPS * float(np.spacing(largest))
    found = np.searchsorted(sample_times, times + rounding, side="right") - 1
    return values[np.maximum(found, 0)]
