"""Spectrum: how the power of a signal is spread over frequencies."""

from __future__ import annotations

import numpy as np
from matplotlib import mlab
from numpy.typing import NDArray

Reals = NDArray[np.float64]


def spectrum(values: Reals, rate: float, max_window: int) -> tuple[Reals, Reals]:
    """Return frequencies [Hz] and the one-sided power density there, by Welch's method.

    Of `values` (samples,) at `rate` [Hz], in Hann windows of at most `max_window` samples that overlap
    by half, each without its mean.
    """
    length = min(len(values), max_window)
    power, frequencies = mlab.psd(values, length, rate, mlab.detrend_mean, noverlap=length // 2)
    return np.asarray(frequencies), np.asarray(power)
