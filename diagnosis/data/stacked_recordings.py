"""Stacked experiments: recordings concatenated into the arrays that a predictor reads."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codegen.predictor.predictor_arrays import StackedRecordings
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording

CACHE_SIZE = 24
"""Number of stacked sets that are cached; the least recently used one is dropped."""


@dataclass(frozen=True)
class StackedExperiments:
    """Recordings as concatenated arrays; `first_measured` is (recordings, outputs)."""

    series: tuple[SampledRecording, ...]
    recorded: StackedRecordings
    first_measured: Reals


_cache: OrderedDict[tuple[int, ...], StackedExperiments] = OrderedDict()


def burn_in_samples(series: SampledRecording) -> int:
    """Return the samples of the burn-in, at least 1; a short recording may have fewer."""
    return series.sample_count(series.burn_in)


def stack_recordings(series: Sequence[SampledRecording]) -> StackedExperiments:
    """Return recordings concatenated in their order; the last `CACHE_SIZE` (24) sets are cached.

    The cache key is the identity of the recordings, which an entry keeps alive.
    """
    key = tuple(id(one) for one in series)
    stacked = _cache.get(key)
    if stacked is None:
        stacked = _cache[key] = _stack(tuple(series))
        if len(_cache) > CACHE_SIZE:
            _cache.popitem(last=False)
    _cache.move_to_end(key)
    return stacked


def _stack(series: tuple[SampledRecording, ...]) -> StackedExperiments:
    """Return recordings concatenated, with the start, burn-in and hold of each of them."""
    counts = [one.count for one in series]
    recorded = StackedRecordings(
        np.concatenate([one.inputs for one in series]),
        np.concatenate([one.measured for one in series]),
        np.cumsum([0, *counts], dtype=np.int64),
        np.array([min(burn_in_samples(one), one.count) for one in series], dtype=np.int64),
        np.array([one.linear_inputs for one in series], dtype=np.int64),
    )
    return StackedExperiments(series, recorded, np.array([one.first_measured for one in series]))
