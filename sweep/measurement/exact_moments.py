"""Moments: mean, deviation, total and quantiles of numbers, also of the largest there are.

Sums are exactly rounded (math.fsum). Where a square or a sum would overflow, numbers are first
divided by a power of two, which rounds nothing; what is too large for a number itself is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
SQUARABLE_LIMIT = 2.0**480
"""Magnitudes below it have squares of which 2**63 can be added without an overflow."""


def scale_to_squarable(values: Reals) -> tuple[Reals, int]:
    """Return values (n,) over a power of two, and its exponent: 0 where they are not large."""
    largest = float(np.max(np.abs(values), initial=0.0))
    if largest < SQUARABLE_LIMIT:
        return values, 0
    exponent = math.frexp(largest)[1]
    return np.ldexp(values, -exponent), exponent


def mean_of(values: Reals) -> float:
    """Return the mean of values (n,), n > 0."""
    own, exponent = scale_to_squarable(values)
    return undo_scale(math.fsum(own) / len(own), exponent)


def deviation_of(values: Reals) -> float:
    """Return the standard deviation of values (n,), n > 1, as that of a sample."""
    own, exponent = scale_to_squarable(values)
    mean = math.fsum(own) / len(own)
    return undo_scale(math.sqrt(math.fsum((own - mean) ** 2) / (len(own) - 1)), exponent)


def root_mean_square(values: Reals) -> float:
    """Return the root of the mean square of values (n,), n > 0."""
    own, exponent = scale_to_squarable(values)
    return undo_scale(math.sqrt(math.fsum(own * own) / len(own)), exponent)


def total_of(values: Reals) -> float:
    """Return the sum of values (n,)."""
    own, exponent = scale_to_squarable(values)
    return undo_scale(math.fsum(own), exponent)


def quantiles_of(values: Reals, levels: Sequence[float]) -> list[float]:
    """Return quantiles of values (n,), n > 0, between which lines are drawn."""
    own, exponent = scale_to_squarable(values)
    return [undo_scale(float(one), exponent) for one in np.quantile(own, levels)]


def undo_scale(number: float, exponent: int) -> float:
    """Return a number times a power of two; NaN where that is too large for a number."""
    try:
        return math.ldexp(number, exponent)
    except OverflowError:
        return math.nan
