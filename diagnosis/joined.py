"""Joined: recordings one after the other, as the predictor takes them; made once for each set."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.runs import Recorded
from diagnosis.series import Series

Reals = NDArray[np.float64]
BURN_IN = 0.5
"""Seconds at the start of a recording that do not count: the states are being found."""
MOST_KEPT = 24
"""Sets of recordings that are kept joined, the latest ones."""


@dataclass(frozen=True)
class Joined:
    """A set of recordings in joined arrays, with the values that they start with.

    `first` (recordings, seen) are the first known values of the compared signals.
    """

    series: tuple[Series, ...]
    recorded: Recorded
    first: Reals


_kept: OrderedDict[tuple[int, ...], Joined] = OrderedDict()


def burnt(series: Series) -> int:
    """Return how many samples at the start of a recording do not count."""
    return max(1, round(BURN_IN / float(series.period)))


def joined(series: Sequence[Series]) -> Joined:
    """Return recordings joined, as they were kept or joined now.

    They are known by their identity: what is kept holds them, so no other one has it meanwhile.
    """
    key = tuple(id(one) for one in series)
    found = _kept.get(key)
    if found is None:
        found = _kept[key] = _joined(tuple(series))
        if len(_kept) > MOST_KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return found


def _joined(series: tuple[Series, ...]) -> Joined:
    counts = [one.count for one in series]
    recorded = Recorded(
        np.concatenate([one.inputs for one in series]),
        np.concatenate([one.measured for one in series]),
        np.cumsum([0, *counts], dtype=np.int64),
        np.array([min(burnt(one), one.count) for one in series], dtype=np.int64),
        np.array([one.is_linear for one in series], dtype=np.int64),
    )
    return Joined(series, recorded, np.array([one.first for one in series]))
