"""Confidence intervals: compute intervals of means, medians and rates of clustered observations.

The numbers of one independent draw (replicates, grid points with the same samples, entries of one
list) are correlated. They form a cluster that counts as one draw.

Mean: ratio estimator over the totals of the draws, variance by linearisation (Cochran, Sampling
Techniques, 3rd ed. 1977, section 6.4), Student's t with the number of draws minus one. Rate: score
interval (Wilson 1927, "Probable inference") at the effective sample size of Korn and Graubard
(Survey Methodology 24 (1998) 193). Median: order statistics (David and Nagaraja, Order Statistics,
section 7.1) at the effective sample size (Woodruff, J. Am. Stat. Assoc. 47 (1952) 635). With one
number in each draw these are the usual intervals.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engine.results.array_types import Reals
from sweep.evaluation.exact_moments import quantiles_of, scale_to_squarable, undo_scale

Interval = tuple[float, float] | None
DrawIndices = NDArray[np.int64]


def sum_by_draw(values: Reals, draws: DrawIndices) -> Reals:
    """Return the sum of the values (n,) of each draw (n_draws,).

    `draws` (n,) holds the index of the draw of each value. The sums are in ascending order of the
    indices that occur; others have no entry.
    """
    _, places = np.unique(draws, return_inverse=True)
    return np.bincount(places.reshape(-1), values).astype(np.float64)


def interval_of_mean(values: Reals, draws: DrawIndices, confidence: float) -> Interval:
    """Return the confidence interval of the mean of values (n,) that belong to draws (n,).

    It is symmetric around the mean: Student's t with the number of draws minus one, and the
    variance of a ratio estimator over the totals of the draws. The ends have the unit of the
    values. Returns None for fewer than two draws, or if an end is not finite.
    """
    count = len(values)
    own, exponent = scale_to_squarable(values)
    totals, sizes = sum_by_draw(own, draws), sum_by_draw(np.ones(count), draws)
    number = len(sizes)
    if number < 2:
        return None
    from scipy.special import stdtrit

    mean = math.fsum(own) / count
    spread = math.fsum((totals - mean * sizes) ** 2) * number / (number - 1)
    half = float(stdtrit(number - 1, 0.5 + confidence / 2.0)) * math.sqrt(spread) / count
    low, high = undo_scale(mean - half, exponent), undo_scale(mean + half, exponent)
    return (low, high) if math.isfinite(low) and math.isfinite(high) else None


def interval_of_rate(hits: Reals, sizes: Reals, confidence: float) -> Interval:
    """Return the score interval of the rate sum(hits) / sum(sizes), with arrays (n_draws,).

    `hits[k]` of the `sizes[k]` trials of draw k were successful. It is the Wilson interval at the
    `effective_sample_size`. Returns None for fewer than two draws with trials.
    """
    count = effective_sample_size(hits, sizes, confidence)
    return (
        wilson_interval(count * float(np.sum(hits) / np.sum(sizes)), count, confidence)
        if count
        else None
    )


def effective_sample_size(hits: Reals, sizes: Reals, confidence: float) -> float:
    """Return the number of independent trials that are as precise for a rate as the clustered ones.

    The arrays (n_draws,) hold the successes and the trials of each draw (Korn and Graubard 1998).
    The result is at most the number of trials. It is the number of draws if the rate is 0 or 1,
    because the variance is then unknown. A factor (squared ratio of the two Student quantiles, at
    most 1) accounts for the uncertainty of the variance. Returns 0 for fewer than two draws with
    trials.
    """
    sizes, hits = sizes[sizes > 0], hits[sizes > 0]
    draws, count = len(sizes), float(np.sum(sizes))
    share = float(np.sum(hits)) / count if count else 0.0
    if draws < 2:
        return 0.0
    if share in (0.0, 1.0):
        return float(draws)
    from scipy.special import stdtrit

    spread = math.fsum((hits - share * sizes) ** 2) / count**2
    effective = share * (1.0 - share) / spread if spread > 0.0 else count
    level = 0.5 + confidence / 2.0
    t_ratio = float(stdtrit(count - 1.0, level) / stdtrit(draws - 1.0, level))
    return min(count, effective) * min(1.0, t_ratio) ** 2


def wilson_interval(hits: float, count: float, confidence: float) -> Interval:
    """Return the score interval (Wilson 1927) of the rate of `hits` successes in `count` trials.

    The numbers may be fractional, because effective sample sizes are. The low end is exactly 0
    without hits, the high end exactly 1 if all are hits. Returns None without trials.
    """
    if count == 0:
        return None
    from scipy.special import ndtri

    z = float(ndtri(0.5 + confidence / 2.0))
    share, spread = hits / count, z * z / count
    middle = (share + spread / 2.0) / (1.0 + spread)
    half = z * math.sqrt(share * (1.0 - share) / count + spread / (4.0 * count)) / (1.0 + spread)
    low = 0.0 if hits == 0 else middle - half
    return max(0.0, low), 1.0 if hits == count else min(1.0, middle + half)


def interval_of_quantile(
    values: Reals, draws: DrawIndices, level: float, confidence: float
) -> Interval:
    """Return the interval of the quantile at `level`, whose ends are two of the values (n,).

    `draws` (n,) holds the draw of each value. For m independent values the ends are the l-th and
    the u-th smallest value with P(l <= B < u) >= confidence, B binomial(m, level). With an
    effective sample size m < n the ranks are scaled by n / m. Returns None if such ranks do not
    exist.
    """
    count = len(values)
    if count == 0:
        return None
    from scipy.stats import binom

    ordered = np.sort(values)
    below = (values <= quantiles_of(ordered, (level,))[0]).astype(np.float64)
    hits, sizes = sum_by_draw(below, draws), sum_by_draw(np.ones(count), draws)
    effective = int(effective_sample_size(hits, sizes, confidence) + COUNT_ROUNDING)
    tail = (1.0 - confidence) / 2.0
    low = int(binom.ppf(tail, effective, level)) if effective else 0
    high = int(binom.ppf(1.0 - tail, effective, level)) + 1
    if low < 1 or high > effective:
        return None
    first, last = (low - 1) * count // effective, -(-high * count // effective) - 1
    return float(ordered[first]), float(ordered[last])


COUNT_ROUNDING = 1e-6
"""Added to an effective sample size before it is truncated, so that rounding does not lose one."""
