"""Initial inputs: hypotheses for the inputs at the first sample, which set the initial states.

The initial position in a backlash gap can depend on the sign of a torque that is only noise. Among
the inputs that are possible within their noise, those with the best prediction by the base are
chosen.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, predict_with_gains_of
from diagnosis.model.parameter_vector import ParameterVector

AVERAGING_TIME = 0.5
"""Middle times at the start over which inputs are averaged."""
HYPOTHESIS_STDS = 4.0
"""Distance of an alternative first input, in standard deviations of its noise."""
MIN_GAIN = 3.0
"""Log-likelihood gain [nat] that an alternative must exceed."""


def average_initial_inputs(series: SampledRecording) -> SampledRecording:
    """Return a recording whose first sample of each input is a mean over the first samples.

    The window is `AVERAGING_TIME`, rounded to samples, at least 1; other samples do not change.
    """
    count = series.sample_count(AVERAGING_TIME)
    inputs = series.inputs.copy()
    inputs[0] = np.mean(inputs[:count], axis=0)
    return dataclasses.replace(series, inputs=inputs)


def choose_initial_inputs(
    model: Estimate, series: Sequence[SampledRecording]
) -> tuple[SampledRecording, ...]:
    """Return recordings with the first inputs that the base predicts best.

    An alternative has one input larger or smaller by `HYPOTHESIS_STDS` (4) standard deviations of
    its noise at the first sample. The one of least cost is taken if it gains more than `MIN_GAIN`
    (3 nats) over the recorded inputs; else the recording itself is returned. The recordings may
    differ from those of the fit, because a base has no parameters per recording.
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
    """Return copies of a recording in which one of
    its first inputs is larger or smaller by 4 sigma.
    """
    hypotheses = []
    for column in range(series.inputs.shape[1]):
        for sign in (1.0, -1.0):
            inputs = series.inputs.copy()
            inputs[0, column] += sign * HYPOTHESIS_STDS * noise[column]
            hypotheses.append(dataclasses.replace(series, inputs=inputs))
    return hypotheses
