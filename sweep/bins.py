"""Bins: the ends of those that a histogram counts values in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
RELATIVE_ROUNDING = 1.0e-9
"""Part of their magnitude by which values differ that are drawn as one: rounding is less."""
MAX_BINS = 60
"""Bins of a histogram: a picture of 7.5 inches shows no more apart."""


def histogram_bin_edges(values: Reals) -> Reals:
    """Return the ends of bins (bins + 1,) of values (n,): as many as Freedman and Diaconis (1981)
    or Sturges (1926) ask for, the larger number; one bin where values differ by next to nothing.
    """
    if not len(values):
        return np.array([0.0, 1.0])
    low, high = float(np.min(values)), float(np.max(values))
    size = max(abs(low), abs(high))
    if high - low <= RELATIVE_ROUNDING * size:
        return np.array([low - 0.5 * (size or 1.0), high + 0.5 * (size or 1.0)])
    upper, lower = np.quantile(values, [0.75, 0.25])
    width = 2.0 * float(upper - lower) * len(values) ** (-1.0 / 3.0)
    wanted = (high - low) / width if width > 0.0 else 0.0
    count = min(max(wanted, np.log2(len(values)) + 1.0), MAX_BINS)
    return np.linspace(low, high, int(np.ceil(count)) + 1)
