"""Interval: confidence intervals of means and of rates.

Rates: Wilson 1927, "Probable inference", eq. for the score interval. Means: Student's t. Medians:
order statistics (David and Nagaraja, Order Statistics, section 7.1): no assumption of a shape.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sweep.moments import deviation_of, mean_of

Interval = tuple[float, float] | None


def wilson(hits: int, count: int, confidence: float) -> Interval:
    """Return the interval of a rate of which `hits` of `count` were seen; None without any."""
    if count == 0:
        return None
    from scipy.special import ndtri

    z = float(ndtri(0.5 + confidence / 2.0))
    share, spread = hits / count, z * z / count
    middle = (share + spread / 2.0) / (1.0 + spread)
    half = z * math.sqrt(share * (1.0 - share) / count + spread / (4.0 * count)) / (1.0 + spread)
    low = 0.0 if hits == 0 else middle - half
    return max(0.0, low), 1.0 if hits == count else min(1.0, middle + half)


def of_mean(values: NDArray[np.float64], confidence: float) -> Interval:
    """Return the interval of a mean [unit of the values] (n,); None for fewer than two values.

    None too where an end is more than a number can hold.
    """
    count = len(values)
    if count < 2:
        return None
    from scipy.special import stdtrit

    mean, deviation = mean_of(values), deviation_of(values)
    half = float(stdtrit(count - 1, 0.5 + confidence / 2.0)) * deviation / math.sqrt(count)
    low, high = mean - half, mean + half
    return (low, high) if math.isfinite(low) and math.isfinite(high) else None


def of_quantile(ordered: Sequence[float], share: float, confidence: float) -> Interval:
    """Return the interval of a quantile between two of the ordered values; None for too few.

    The l-th and u-th smallest: P(l <= B < u) >= confidence, B binomial(n, share).
    """
    count = len(ordered)
    from scipy.stats import binom

    tail = (1.0 - confidence) / 2.0
    low = int(binom.ppf(tail, count, share)) if count else 0
    high = int(binom.ppf(1.0 - tail, count, share)) + 1
    if count == 0 or low < 1 or high > count:
        return None
    return float(ordered[low - 1]), float(ordered[high - 1])
