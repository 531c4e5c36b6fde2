"""Noise: how much of a sampled signal is noise and quantisation, from its quietest stretches."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
WINDOW_SAMPLES = 50
"""Samples of a stretch."""
NOISE_QUANTILE = 0.2
"""The part of the stretches that counts as quiet."""
MAD_TO_STD = 1.4826
"""Standard deviation of a normal variable over its median absolute deviation."""


def noise_of(values: Reals) -> float:
    """Return the standard deviation of the white part of a signal (samples,); NaN is left out.

    From second differences, which have 6 times the variance of white noise; not less than that
    of the quantisation.
    """
    known = values[np.isfinite(values)]
    if len(known) < 5:
        return 0.0
    spread = MAD_TO_STD * _window_medians(np.abs(np.diff(known, n=2)))
    white = float(np.quantile(spread, NOISE_QUANTILE)) / 6.0**0.5
    return float(max(white, quantum_of(known) / 12.0**0.5))


def _window_medians(sizes: Reals) -> Reals:
    """Return the median of each stretch of sizes (n,): the first ones have one more of them."""
    count = max(1, len(sizes) // WINDOW_SAMPLES)
    width, more = divmod(len(sizes), count)
    edge = more * (width + 1)
    longer, others = sizes[:edge].reshape(more, width + 1), sizes[edge:].reshape(-1, width)
    found = [np.median(part, axis=1) for part in (longer, others) if len(part)]
    return np.concatenate(found)


def quantum_of(values: Reals) -> float:
    """Return the step of a quantised signal: the smallest difference of its values, not 0."""
    gaps = np.diff(np.unique(values))
    gaps = gaps[gaps > 1e-9 * max(1.0, float(np.max(np.abs(values), initial=0.0)))]
    return float(np.min(gaps)) if len(gaps) else 0.0
