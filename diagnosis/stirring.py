"""Stirring: whether what is unknown is loud when known inputs move.

A hidden input comes when it likes. What a model gets wrong of its actuator, shaft or tyre is heard
whenever the known inputs change: it is no input, whatever its sign.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.joined import burnt
from diagnosis.series import Series

Reals = NDArray[np.float64]
WITHIN = 0.3
"""Seconds in which an answer to a moved input is heard."""
SMOOTH = 0.05
"""Seconds over which an input is averaged before its rate is taken: it has noise."""


def stirring(series: Sequence[Series], unknown: Sequence[Reals]) -> float:
    """Return how loudness goes with the movement of an input, at most: a correlation.

    `unknown` (samples,) in each recording is known from where its states were found.
    """
    loud = [_around(np.abs(u), one, WITHIN) for u, one in zip(unknown, series, strict=True)]
    whole = np.concatenate(loud)
    most = 0.0
    for column in range(series[0].inputs.shape[1]):
        moved = np.concatenate(
            [_movement(one, column, len(u)) for u, one in zip(unknown, series, strict=True)]
        )
        if np.std(moved) > 0.0 and np.std(whole) > 0.0:
            most = max(most, float(np.corrcoef(whole, moved)[0, 1]))
    return most


def _movement(series: Series, column: int, count: int) -> Reals:
    """Return how much an input moves around each sample (count,)."""
    values = series.inputs[burnt(series) : burnt(series) + count, column]
    even = _around(values, series, SMOOTH)
    return _around(np.abs(np.diff(even, prepend=even[:1])), series, WITHIN)


def _around(values: Reals, series: Series, seconds: float) -> Reals:
    """Return means over some seconds around each sample."""
    count = max(3, round(seconds / float(series.period)))
    padded = np.pad(values, (count // 2, count - 1 - count // 2), mode="edge")
    return np.asarray(np.convolve(padded, np.full(count, 1.0 / count), "valid"), dtype=np.float64)
