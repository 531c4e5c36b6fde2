"""Waveform statistics: peak, mean, RMS, settling time and frequency of a sampled signal.

Sums are correctly rounded (math.fsum), so that the bits are the same on all machines.
"""

from __future__ import annotations

import math

import numpy as np

from engine.results.array_types import Reals
from sweep.definition.measure import SignalMeasure
from sweep.evaluation.exact_moments import mean_of, root_mean_square, scale_to_squarable

MIN_SPECTRUM_ROWS = 8
"""Smallest number of samples of a spectrum."""
FLATNESS_TOLERANCE = 1.0e-12
"""A signal is a straight line if its deviation, relative to its peak, is smaller: rounding errors.
"""


def evaluate_signal(measure: SignalMeasure, times: Reals, values: Reals) -> float | None:
    """Return the statistic of a signal (n,) over times [s] (n,), in the unit of the measure.

    `final` is the last value, `peak` the largest magnitude. Returns None for an empty window, a
    value that is not finite, or no frequency; NaN if the mean or root mean square overflows.
    """
    if not len(values) or not np.all(np.isfinite(values)):
        return None
    match measure.kind:
        case "peak":
            return float(np.max(np.abs(values)))
        case "max":
            return float(np.max(values))
        case "min":
            return float(np.min(values))
        case "final":
            return float(values[-1])
        case "mean":
            return mean_of(values)
        case "rms":
            return root_mean_square(values)
        case "settling":
            return settling_time(times, values, measure.within)
        case "frequency":
            find = frequency_by_spectrum if measure.by == "spectrum" else frequency_by_crossings
            return find(times, scale_to_squarable(values)[0])


def settling_time(times: Reals, values: Reals, band: float) -> float:
    """Return the time [s] from the first sample until the signal stays close to its last value.

    That is the first sample from which on no value differs from the last one by more than `band`.
    """
    with np.errstate(over="ignore"):  # an infinite difference is outside the band
        outside = np.flatnonzero(np.abs(values - values[-1]) > band)
    first = int(outside[-1]) + 1 if len(outside) else 0
    return float(times[first] - times[0])


def frequency_by_crossings(times: Reals, values: Reals) -> float | None:
    """Return the mean frequency [1/s] between the first and the last upward crossing of the signal.

    The signal is taken minus its least-squares line; crossing times are interpolated linearly.
    Returns None for fewer than two crossings.
    """
    level = _detrend(times, values)
    if not len(level):
        return None
    ups = np.flatnonzero((level[:-1] < 0.0) & (level[1:] >= 0.0))
    if len(ups) < 2:
        return None
    share = level[ups] / (level[ups] - level[ups + 1])
    instants = times[ups] + share * (times[ups + 1] - times[ups])
    return float((len(ups) - 1) / (instants[-1] - instants[0]))


def frequency_by_spectrum(times: Reals, values: Reals) -> float | None:
    """Return the frequency [1/s] of the peak of the spectrum with a Hann window.

    The signal is taken minus its least-squares line. A parabola through the logarithms interpolates
    between bins (Smith and Serra, PARSHL, 1987). Returns None for fewer than MIN_SPECTRUM_ROWS
    samples or a straight line. Samples must be equidistant.
    """
    count = len(values)
    level = _detrend(times, values)
    if len(level) < MIN_SPECTRUM_ROWS:
        return None
    power = np.abs(np.fft.rfft(level * np.hanning(count))) ** 2
    top = int(np.argmax(power[1:-1])) + 1
    if power[top] == 0.0:
        return None
    left, middle, right = np.log(np.maximum(power[top - 1 : top + 2], 1e-300))
    bend = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    step = float(times[-1] - times[0]) / (count - 1)
    return float((top + shift) / (count * step))


def _detrend(times: Reals, values: Reals) -> Reals:
    """Return a signal (n,) minus its least-squares line; empty if only rounding errors remain."""
    count = len(values)
    middle, mean = math.fsum(times) / count, math.fsum(values) / count
    away = times - middle
    spread = math.fsum(away * away)
    slope = math.fsum(away * values) / spread if spread else 0.0
    level = np.asarray(values - (mean + slope * away))
    is_flat = np.max(np.abs(level)) <= FLATNESS_TOLERANCE * np.max(np.abs(values))
    return level[:0] if is_flat else level
