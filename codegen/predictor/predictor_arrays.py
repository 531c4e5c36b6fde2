"""Predictor arrays: the arrays that a predictor reads of recordings, and the arrays that it
returns."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Prediction:
    """The result of a predictor on one recording.

    `innovations` and `outputs` of the model have the shape (samples, outputs), `states` (samples,
    states), `modes` (samples,). `completed` is the number of samples before a state diverged;
    entries after that are not valid.
    """

    innovations: Reals
    outputs: Reals
    states: Reals
    modes: NDArray[np.int16]
    completed: int


@dataclass(frozen=True)
class StackedRecordings:
    """Several recordings, stacked along the samples in C-contiguous arrays.

    `inputs` has the shape (samples, inputs) and `measured` (samples, outputs), with NaN where
    nothing was measured. Recording r has the samples from `starts[r]` up to `starts[r + 1]`. Its
    first `burn_in[r]` samples do not count in sums. Its input i is linear between samples if
    `linear_inputs[r, i]`, else constant.
    """

    inputs: Reals
    measured: Reals
    starts: Integers
    burn_in: Integers
    linear_inputs: Integers


@dataclass(frozen=True)
class StackedPrediction:
    """The results of a predictor on several recordings, stacked along the samples.

    `completed` (recordings,) gives the number of samples of each recording before a state diverged.
    `squared_sums` and `counts` (recordings, outputs) are the sums of squared innovations, and the
    number of innovations in them.
    """

    stacked: Prediction
    starts: Integers
    completed: Integers
    squared_sums: Reals
    counts: Reals

    def split(self) -> tuple[Prediction, ...]:
        """Return the result of each recording in their order, with views of the stacked arrays."""
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
