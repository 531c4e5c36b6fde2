"""Runs: what a predictor is given of recordings, and what it foresees of them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Prediction:
    """What a run gave: `innovations` and what the model showed, `seen` (samples, seen); `states`
    (samples, states), `modes` (samples,); `done` samples before a value left all bounds.
    """

    innovations: Reals
    outputs: Reals
    states: Reals
    modes: NDArray[np.int16]
    completed: int


@dataclass(frozen=True)
class StackedRecordings:
    """Recordings one after the other in C-contiguous arrays: `inputs` (samples, inputs), and
    `measured` (samples, seen) with NaN where nothing is known.

    Recording r has the samples from `starts[r]` to `starts[r + 1]`, of which the first `skips[r]`
    do not count; its inputs are held, or run straight in between where `linear[r]`.
    """

    inputs: Reals
    measured: Reals
    starts: Integers
    burn_in: Integers
    is_first_order_hold: Integers


@dataclass(frozen=True)
class StackedPrediction:
    """What the runs of several recordings gave, one after the other as in a Prediction.

    `squares` and `counts` (recordings, seen) are the sums of the squares that count, and how many.
    """

    stacked: Prediction
    starts: Integers
    completed: Integers
    squared_sums: Reals
    counts: Reals

    def split(self) -> tuple[Prediction, ...]:
        """Return the run of each recording, views of what is here."""
        stacked, edges = self.stacked, pairwise(self.starts.tolist())
        return tuple(
            Prediction(
                stacked.innovations[low:high],
                stacked.outputs[low:high],
                stacked.states[low:high],
                stacked.modes[low:high],
                done,
            )
            for (low, high), done in zip(edges, self.completed.tolist(), strict=True)
        )
