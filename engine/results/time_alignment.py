"""Time alignment: the time shift at which two runs correlate best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from engine.results.array_types import Reals
from engine.results.resampling import resample_signal
from engine.results.sampled_run import matches_any
from engine.results.trajectory import Trajectory
from language.text.diagnostic import DataError

MAX_SAMPLES = 100_000
"""Largest number of samples of a run on the common time grid."""
MIN_OVERLAP = 0.5
"""Smallest part of the shorter run that overlaps the other one after the shift."""
MIN_CORRELATION = 0.5
"""Smallest normalised correlation of a shift that is used."""


@dataclass(frozen=True)
class TimeShift:
    """Time [s] that is added to the times of the second run; their correlation, None if stated."""

    offset: float
    correlation: float | None = None


NO_SHIFT = TimeShift(0.0)
"""The shift of runs whose times are compared as they are."""


def shift_times(run: Trajectory, offset: float) -> Trajectory:
    """Return a run whose samples and events are later by `offset` [s]."""
    if not offset:
        return run
    events = tuple(replace(event, time=event.time + offset) for event in run.events)
    return replace(run, times=run.times + offset, events=events)


def find_time_shift(a: Trajectory, b: Trajectory, patterns: Sequence[str] = ()) -> TimeShift:
    """Return the shift of the times of `b` with the largest normalised correlation to `a`.

    The signals in both runs that vary count, selected by `patterns` (fnmatch): each is resampled to
    the smaller median period of both runs, and its mean is removed. The runs overlap by MIN_OVERLAP
    of the shorter one at least. The shift is then refined to the smallest sum of squared
    differences within one period. Raises DataError if no common signal varies or if the best
    correlation is below MIN_CORRELATION.
    """
    names = [n for n in a.signals if n in b.signals and matches_any(n, patterns)]
    names = [n for n in names if _varies(a, n) and _varies(b, n)]
    if not names:
        raise DataError("no signal of both runs varies, so that no time shift can be found")
    longest = max(float(np.ptp(run.times)) for run in (a, b))
    periods = [float(np.median(np.diff(run.times))) for run in (a, b)]
    period = max(min((p for p in periods if p > 0.0), default=0.0), longest / MAX_SAMPLES)
    grids = [np.arange(run.times[0], run.times[-1] + period / 2, period) for run in (a, b)]
    lags, correlations = _correlate(a, b, names, grids)
    best = int(np.argmax(correlations))
    if correlations[best] < MIN_CORRELATION:
        text = f"the runs do not correlate at any time shift: at most {correlations[best]:.2f}"
        raise DataError(f"{text}, {MIN_CORRELATION} is needed; `--offset` states the shift")
    coarse = float(a.times[0] - b.times[0] + lags[best] * period)
    offset = _refine(a, b, names, coarse, period)
    return TimeShift(offset, float(min(correlations[best], 1.0)))


def _varies(run: Trajectory, name: str) -> bool:
    """Return whether a signal has finite values only, and at least two different ones."""
    values = run.signals[name].astype(np.float64)
    return len(values) > 1 and bool(np.isfinite(values).all()) and bool(np.ptp(values))


def _correlate(
    a: Trajectory, b: Trajectory, names: Sequence[str], grids: Sequence[Reals]
) -> tuple[Reals, Reals]:
    """Return the lags in samples (n_lags,) and the normalised correlations (n_lags,) of two runs.

    The correlation of a lag is the sum of products over the overlap, divided by the root of the
    energies of both runs in the overlap; it is the mean over the signals.
    """
    from scipy.signal import correlate

    n_a, n_b = map(len, grids)
    lags = np.arange(-(n_b - 1), n_a, dtype=np.float64)
    total = np.zeros(len(lags))
    for name in names:
        x, y = (resample_signal(run, name, grid) for run, grid in zip((a, b), grids, strict=True))
        centre = float(np.mean(np.concatenate([x, y])))
        x, y = x - centre, y - centre
        products = correlate(x, y, mode="full", method="fft")
        energy_x = correlate(x**2, np.ones(n_b), mode="full", method="fft")
        energy_y = correlate(np.ones(n_a), y**2, mode="full", method="fft")
        scale = np.sqrt(np.maximum(energy_x, 0.0) * np.maximum(energy_y, 0.0))
        floor = 1e-9 * float(np.sqrt(np.sum(x**2) * np.sum(y**2)))  # rounding of the FFT
        total += np.where(scale > floor, products / np.maximum(scale, floor), 0.0)
    overlap = np.minimum(lags + n_b, n_a) - np.maximum(lags, 0)
    total[overlap < MIN_OVERLAP * min(n_a, n_b)] = -np.inf
    return lags, total / len(names)


def _refine(
    a: Trajectory, b: Trajectory, names: Sequence[str], coarse: float, period: float
) -> float:
    """Return the shift [s] within one period of `coarse` with the smallest squared difference.

    `coarse` remains if no other shift is better by more than rounding.
    """
    from scipy.optimize import minimize_scalar

    scales = {name: float(np.std(a.signals[name])) or 1.0 for name in names}

    def cost(offset: float) -> float:
        shifted = shift_times(b, offset)
        low = max(a.times[0], shifted.times[0])
        high = min(a.times[-1], shifted.times[-1])
        times = a.times[(a.times >= low) & (a.times <= high)]
        if not len(times):
            return np.inf
        squares = (
            float(np.mean((resample_signal(a, n, times) - resample_signal(shifted, n, times)) ** 2))
            / scales[n] ** 2
            for n in names
        )
        return float(sum(squares))

    bounds = (coarse - period, coarse + period)
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-3 * period})
    return float(found.x) if found.fun < (1.0 - 1e-6) * cost(coarse) else coarse
