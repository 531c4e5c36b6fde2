"""Spectrum: the power spectral density of a signal."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from diagnosis.data.array_types import Reals


def spectrum(values: Reals, rate: float, max_window: int) -> tuple[Reals, Reals]:
    """Return frequencies [Hz] and the one-sided power spectral density of a signal (Welch 1967).

    `values` (samples,) are sampled at `rate` [Hz]. The Hann windows have `max_window` samples (all
    if there are fewer), overlap by half, and the mean of each window is subtracted.
    """
    length = min(len(values), max_window)
    frequencies, power = welch(
        values, rate, np.hanning(length), noverlap=length // 2, detrend="constant"
    )
    return frequencies, power
