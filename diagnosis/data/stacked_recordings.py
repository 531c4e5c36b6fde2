"""Stacked experiments: recordings concatenated into the arrays that a predictor reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codegen.predictor.predictor_arrays import StackedRecordings
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording


@dataclass(frozen=True)
class StackedExperiments:
    """Recordings as concatenated arrays; `first_measured` is (recordings, outputs)."""

    recorded: StackedRecordings
    first_measured: Reals


def burn_in_samples(series: SampledRecording) -> int:
    """Return the samples of the burn-in, at least 1; a short recording may have fewer."""
    return series.sample_count(series.burn_in)


def stack_recordings(series: Sequence[SampledRecording]) -> StackedExperiments:
    """Return recordings concatenated in their order, with start, burn-in and hold of each."""
    recorded = StackedRecordings(
        np.concatenate([one.inputs for one in series]),
        np.concatenate([one.measured for one in series]),
        np.cumsum([0, *(one.count for one in series)], dtype=np.int64),
        np.array([min(burn_in_samples(one), one.count) for one in series], dtype=np.int64),
        np.array([one.linear_inputs for one in series], dtype=np.int64),
    )
    return StackedExperiments(recorded, np.array([one.first_measured for one in series]))
