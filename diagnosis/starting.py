"""Starting: the inputs at the first sample of a recording, on which its states start.

Where a gap is at the start may hang on the sign of a torque that is nothing but noise. Of inputs
that could have been, those are taken with which the base foresees what follows.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate, outcome_at
from diagnosis.point import Point
from diagnosis.series import Series

Reals = NDArray[np.float64]
SETTLED = 0.1
"""Seconds at the start over which inputs are taken for constant."""
APART = 4.0
"""Standard deviations of its noise by which a first input may be another one."""
CLEARLY = 3.0
"""Nats by which another start must foresee better."""


def settled_at_start(series: Series) -> Series:
    """Return a recording whose first inputs are the means of its first ones."""
    count = max(1, round(SETTLED / float(series.period)))
    inputs = series.inputs.copy()
    inputs[0] = np.mean(inputs[:count], axis=0)
    return dataclasses.replace(series, inputs=inputs)


def started(model: Estimate, series: Sequence[Series]) -> tuple[Series, ...]:
    """Return recordings with the first inputs with which a base foresees them best.

    They need not be those that it was fitted to: a base has no parameters of single recordings.
    """
    variances = model.outcome.variances
    alone = Point(model.point.shared, model.point.shared[np.newaxis])
    found = []
    for one in series:
        costs = []
        trials = [one, *_others(one, model.noises.inputs)]
        for trial in trials:
            outcome = outcome_at(model, [trial], alone)
            squares = outcome.runs.squares[0]
            costs.append(0.5 * float(np.sum(squares / variances)) if outcome.is_whole else np.inf)
        best = int(np.argmin(costs))
        found.append(trials[best] if costs[best] < costs[0] - CLEARLY else one)
    return tuple(found)


def _others(series: Series, noise: Reals) -> list[Series]:
    """Return a recording with each of its first inputs more and less by its noise."""
    found = []
    for column in range(series.inputs.shape[1]):
        for sign in (1.0, -1.0):
            inputs = series.inputs.copy()
            inputs[0, column] += sign * APART * noise[column]
            found.append(dataclasses.replace(series, inputs=inputs))
    return found
