"""Likeness: where a candidate has its modes, as a model near it was seen to have them.

Gains are made where a mode was seen. A run with gains from the first sample strays: what it shows
of rest or of a gap can cost thousands of nats, and hide what a candidate gains.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.prediction import PredictionResult


def share_operating_points(
    candidate: Candidate,
    prediction: PredictionResult,
    near_candidate: Candidate,
    near_prediction: PredictionResult,
) -> PredictionResult:
    """Return the `prediction` outcome of a candidate with states and modes of a `near_prediction` one of a model
    near it, for the same recordings; as it is where their modes or samples are others.
    """
    mine, theirs = prediction.runs.stacked, near_prediction.runs.stacked
    is_alike = (
        candidate.predictor.modes == near_candidate.predictor.modes and prediction.is_complete
    )
    if not (is_alike and near_prediction.is_complete and len(mine.states) == len(theirs.states)):
        return prediction
    states, places = (
        mine.states.copy(),
        {n: k for k, n in enumerate(near_candidate.predictor.states)},
    )
    for column, name in enumerate(candidate.predictor.states):
        if name in places:
            states[:, column] = theirs.states[:, places[name]]
    if not np.all(np.isfinite(states)):
        return prediction
    whole = dataclasses.replace(mine, states=states, modes=theirs.modes)
    return dataclasses.replace(prediction, runs=dataclasses.replace(prediction.runs, stacked=whole))
