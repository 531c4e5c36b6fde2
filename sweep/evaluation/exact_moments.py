"""Exact moments: compute mean, deviation, sum and quantiles without overflow.

Sums are correctly rounded (math.fsum). If squares or sums could overflow, the values are first
divided by a power of two, which is exact. A result that overflows is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from engine.results.array_types import Reals

SQUARABLE_LIMIT = 2.0**480
"""Values of smaller magnitude have squares of which 2**63 can be added without overflow."""


def scale_to_squarable(values: Reals) -> tuple[Reals, int]:
    """Return values (n,) divided by 2**exponent, and the exponent.

    The exponent is 0, and the values are unchanged, if all magnitudes are below SQUARABLE_LIMIT;
    else the scaled magnitudes are below 1.
    """
    largest = float(np.max(np.abs(values), initial=0.0))
    if largest < SQUARABLE_LIMIT:
        return values, 0
    exponent = math.frexp(largest)[1]
    return np.ldexp(values, -exponent), exponent


def mean_of(values: Reals) -> float:
    """Return the mean of values (n,), n > 0; NaN on overflow."""
    own, exponent = scale_to_squarable(values)
    return undo_scale(math.fsum(own) / len(own), exponent)


def deviation_of(values: Reals) -> float:
    """Return the sample standard deviation (divisor n - 1) of values (n,), n > 1.

    The result is NaN if it overflows.
    """
    own, exponent = scale_to_squarable(values)
    mean = math.fsum(own) / len(own)
    return undo_scale(math.sqrt(math.fsum((own - mean) ** 2) / (len(own) - 1)), exponent)


def root_mean_square(values: Reals) -> float:
    """Return the root mean square of values (n,), n > 0; NaN on overflow."""
    own, exponent = scale_to_squarable(values)
    return undo_scale(math.sqrt(math.fsum(own * own) / len(own)), exponent)


def total_of(values: Reals) -> float:
    """Return the sum of values (n,), 0 without values; NaN on overflow."""
    own, exponent = scale_to_squarable(values)
    return undo_scale(math.fsum(own), exponent)


def quantiles_of(values: Reals, levels: Sequence[float]) -> list[float]:
    """Return the quantiles of values (n,), n > 0, at the levels, with linear interpolation.

    The values need not be sorted; levels are from 0 to 1.
    """
    own, exponent = scale_to_squarable(values)
    return [undo_scale(float(one), exponent) for one in np.quantile(own, levels)]


def undo_scale(number: float, exponent: int) -> float:
    """Return number * 2**exponent; NaN if it overflows."""
    try:
        return math.ldexp(number, exponent)
    except OverflowError:
        return math.nan
