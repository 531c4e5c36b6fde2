"""Noise estimation: the standard deviation of white noise and quantisation of a sampled signal."""

from __future__ import annotations

import numpy as np

from diagnosis.data.array_types import Reals

WINDOW_SAMPLES = 50
"""Samples of a window."""
NOISE_QUANTILE = 0.2
"""Quantile of the windows, ordered by their spread, at which the noise is read."""
MAD_TO_STD = 1.4826
"""Standard deviation of a normal variable over its median absolute deviation."""


def noise_of(values: Reals) -> float:
    """Return the standard deviation of the white noise in a signal (samples,); NaN is ignored.

    It is the `NOISE_QUANTILE` of windows by the median second difference, and at least that of the
    quantisation, `quantum_of` / sqrt(12); 0 for fewer than 5 known values.
    """
    known = values[np.isfinite(values)]
    if len(known) < 5:
        return 0.0
    spread = MAD_TO_STD * _window_medians(np.abs(np.diff(known, n=2)))
    white = float(np.quantile(spread, NOISE_QUANTILE)) / 6.0**0.5
    return float(max(white, quantum_of(known) / 12.0**0.5))


def _window_medians(sizes: Reals) -> Reals:
    """Return the median of each window of `sizes` (n,), of `WINDOW_SAMPLES` or more, in order."""
    windows = np.array_split(sizes, max(1, len(sizes) // WINDOW_SAMPLES))
    return np.array([np.median(window) for window in windows])


def quantum_of(values: Reals) -> float:
    """Return the quantisation step of a signal: the smallest difference of distinct values.

    Differences up to 1e-9 times the largest magnitude are ignored; the result is 0 if no difference
    is left. `values` must not contain NaN.
    """
    gaps = np.diff(np.unique(values))
    gaps = gaps[gaps > 1e-9 * float(np.max(np.abs(values), initial=0.0))]
    return float(np.min(gaps)) if len(gaps) else 0.0
