"""Path spectrum: the strongest periods of innovations over a path, such as the angle of a shaft."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter

from diagnosis.data.array_types import Reals

PEAKS = 4
"""Number of periods, the half wave over the whole path included."""
BINS_PER_WAVE = 8
"""Bins of the path in the shortest wave, which limits the error of a phase."""
SLOW_PART = 0.2
"""Part of the steps along the path that are slow: a short wave shows in these alone."""
MAX_BINS = 2**18
"""Most bins of a path; the shortest wave is longer for a very long one."""
BACKGROUND_WIDTH = 41
"""Waves over the longest path whose median power is the background of a peak."""


def strongest_orders(
    paths: Sequence[Reals], innovations: Sequence[Reals], low: float, high: float
) -> tuple[float, ...]:
    """Return the orders [rad per unit of the path] from `low` to `high` of largest power.

    `paths` (samples,) and `innovations` (samples, outputs) have one array per recording. The power
    at an order q is the sum over recordings and outputs of |sum_k e_k exp(i q path_k)|^2 (Scargle
    1982), relative to the median power of neighbouring orders. Correlated innovations are whitened
    by their correlation from sample to sample first, so that a drift does not hide a wave. Waves
    shorter than two steps of the slow part of the path are left out. The first order is half a wave
    over the longest path. Empty if nothing moves.
    """
    pairs = [pair for pair in zip(paths, innovations, strict=True) if len(pair[0]) > 1]
    lengths = [float(np.ptp(path)) for path, _ in pairs]
    longest = max(lengths, default=0.0)
    steps = np.abs(np.concatenate([np.diff(path) for path, _ in pairs] or [np.empty(0)]))
    moving = steps[steps > 0.0]
    pace = float(np.quantile(moving, SLOW_PART)) if len(moving) else 0.0
    if not (math.isfinite(longest) and longest > 0.0 and pace > 0.0):
        return ()
    shortest = max(2.0 * pace, BINS_PER_WAVE * longest / MAX_BINS)
    width = shortest / BINS_PER_WAVE
    size = 2 ** math.ceil(math.log2(2.0 * longest / width + 2.0))
    power = sum(_binned_power(path, values, width, size) for path, values in pairs)
    orders = 2.0 * np.pi / (size * width) * np.arange(size // 2 + 1)
    resolution = 2.0 * np.pi / longest
    wide = max(3, int(BACKGROUND_WIDTH * resolution / orders[1])) | 1
    relative = power / np.maximum(median_filter(power, wide), np.finfo(float).tiny)
    is_open = (orders >= max(low, resolution)) & (orders <= min(high, 2.0 * np.pi / shortest))
    apart = 2.0 * np.pi / float(np.median([length for length in lengths if length > 0.0]))
    found = [float(np.clip(resolution / 2.0, low, high))]
    while np.any(is_open) and len(found) < PEAKS:
        best = int(np.argmax(np.where(is_open, relative, -1.0)))
        found.append(float(orders[best]))
        is_open &= np.abs(orders - orders[best]) > apart
    return tuple(found)


def _binned_power(path: Reals, innovations: Reals, width: float, size: int) -> Reals:
    """Return the power (orders,) of innovations that are summed over bins of their path."""
    bins = ((path - np.min(path)) / width).astype(np.intp)
    known = _whiten(np.where(np.isfinite(innovations), innovations, 0.0))
    scale = np.maximum(np.sqrt(np.sum(known**2, axis=0)), np.finfo(float).tiny)
    sums = [np.bincount(bins, column, size)[:size] for column in (known / scale).T]
    return np.asarray(np.sum([np.abs(np.fft.rfft(one)) ** 2 for one in sums], axis=0))


def _whiten(values: Reals) -> Reals:
    """Return values (samples, outputs) less their prediction from the sample before."""
    before, after = values[:-1], values[1:]
    energy = np.maximum(np.sum(before**2, axis=0), np.finfo(float).tiny)
    white = values.copy()
    white[1:] -= np.sum(before * after, axis=0) / energy * before
    return white
