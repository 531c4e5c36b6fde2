"""Joined: recordings one after the other, as the predictor takes them; made once for each set."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.predictor.predictions import StackedRecordings
from diagnosis.data.sampled_recording import SampledRecording

Reals = NDArray[np.float64]
BURN_IN = 0.5
"""Seconds at the start of a recording that do not count: the states are being found."""
CACHE_SIZE = 24
"""Sets of recordings that are kept joined, the latest ones."""


@dataclass(frozen=True)
class StackedExperiments:
    """A set of recordings in joined arrays, with the values that they start with.

    `first` (recordings, seen) are the first known values of the compared signals.
    """

    series: tuple[SampledRecording, ...]
    recorded: StackedRecordings
    first_measured: Reals


_cache: OrderedDict[tuple[int, ...], StackedExperiments] = OrderedDict()


def burn_in_samples(series: SampledRecording) -> int:
    """Return how many samples at the start of a recording do not count."""
    return max(1, round(BURN_IN / float(series.period)))


def stack_recordings(series: Sequence[SampledRecording]) -> StackedExperiments:
    """Return recordings joined, as they were kept or joined now.

    They are known by their identity: what is kept holds them, so no other one has it meanwhile.
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
    counts = [one.count for one in series]
    recorded = StackedRecordings(
        np.concatenate([one.inputs for one in series]),
        np.concatenate([one.measured for one in series]),
        np.cumsum([0, *counts], dtype=np.int64),
        np.array([min(burn_in_samples(one), one.count) for one in series], dtype=np.int64),
        np.array([one.is_first_order_hold for one in series], dtype=np.int64),
    )
    return StackedExperiments(series, recorded, np.array([one.first_measured for one in series]))
