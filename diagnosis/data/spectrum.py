"""Spectrum: the power spectral density of a signal."""

from __future__ import annotations

import numpy as np
from matplotlib import mlab
from numpy.typing import NDArray

Reals = NDArray[np.float64]


def spectrum(values: Reals, rate: float, max_window: int) -> tuple[Reals, Reals]:
    """Return frequencies [Hz] and the one-sided power spectral density of a signal (Welch 1967).

    `values` (samples,) are sampled at `rate` [Hz]. The Hann windows have at most `max_window`
    samples, overlap by half, and are taken without their mean.
    """
    length = min(len(values), max_window)
    power, frequencies = mlab.psd(values, length, rate, mlab.detrend_mean, noverlap=length // 2)
    return np.asarray(frequencies), np.asarray(power)
