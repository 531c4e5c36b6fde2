"""Spectrum: the power spectral density of a signal."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from diagnosis.data.array_types import Reals


def spectrum(values: Reals, rate: float, max_window: int) -> tuple[Reals, Reals]:
    """Return frequencies [Hz] and one-sided power spectral density (Welch 1967) at `rate` [Hz].

    Hann windows of `max_window` samples (all if fewer) overlap by half.
    """
    length = min(len(values), max_window)
    frequencies, power = welch(
        values, rate, np.hanning(length), noverlap=length // 2, detrend="constant"
    )
    return frequencies, power
