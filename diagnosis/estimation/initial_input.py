"""Starting: the inputs at the first sample of a recording, on which its states start.

Where a gap is at the start may hang on the sign of a torque that is nothing but noise. Of inputs
that could have been, those are taken with which the base foresees what follows.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, predict_with_gains_of
from diagnosis.model.parameter_vector import ParameterVector

Reals = NDArray[np.float64]
AVERAGING_TIME = 0.1
"""Seconds at the start over which inputs are taken for constant."""
HYPOTHESIS_STDS = 4.0
"""Standard deviations of its noise by which a first input may be another one."""
MIN_GAIN = 3.0
"""Nats by which another start must foresee better."""


def average_initial_inputs(series: SampledRecording) -> SampledRecording:
    """Return a recording whose first inputs are the means of its first ones."""
    count = max(1, round(AVERAGING_TIME / float(series.period)))
    inputs = series.inputs.copy()
    inputs[0] = np.mean(inputs[:count], axis=0)
    return dataclasses.replace(series, inputs=inputs)


def choose_initial_inputs(
    model: Estimate, series: Sequence[SampledRecording]
) -> tuple[SampledRecording, ...]:
    """Return recordings with the first inputs with which a base foresees them best.

    They need not be those that it was fitted to: a base has no parameters of single recordings.
    """
    variances = model.prediction.variances
    shared_point = ParameterVector(model.point.shared, model.point.shared[np.newaxis])
    chosen = []
    for one in series:
        costs = []
        trials = [one, *_initial_input_hypotheses(one, model.noise_levels.inputs)]
        for trial in trials:
            prediction = predict_with_gains_of(model, [trial], shared_point)
            squares = prediction.runs.squared_sums[0]
            costs.append(
                0.5 * float(np.sum(squares / variances)) if prediction.is_complete else np.inf
            )
        best = int(np.argmin(costs))
        chosen.append(trials[best] if costs[best] < costs[0] - MIN_GAIN else one)
    return tuple(chosen)


def _initial_input_hypotheses(series: SampledRecording, noise: Reals) -> list[SampledRecording]:
    """Return a recording with each of its first inputs more and less by its noise."""
    hypotheses = []
    for column in range(series.inputs.shape[1]):
        for sign in (1.0, -1.0):
            inputs = series.inputs.copy()
            inputs[0, column] += sign * HYPOTHESIS_STDS * noise[column]
            hypotheses.append(dataclasses.replace(series, inputs=inputs))
    return hypotheses
