"""Likeness: where a candidate has its modes, as a model near it was seen to have them.

Gains are made where a mode was seen. A run with gains from the first sample strays: what it shows
of rest or of a gap can cost thousands of nats, and hide what a candidate gains.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.prediction import Outcome


def seen_like(candidate: Candidate, own: Outcome, near: Candidate, known: Outcome) -> Outcome:
    """Return the `own` outcome of a candidate with states and modes of a `known` one of a model
    near it, for the same recordings; as it is where their modes or samples are others.
    """
    mine, theirs = own.runs.whole, known.runs.whole
    is_alike = candidate.predictor.modes == near.predictor.modes and own.is_whole
    if not (is_alike and known.is_whole and len(mine.states) == len(theirs.states)):
        return own
    states, places = mine.states.copy(), {n: k for k, n in enumerate(near.predictor.states)}
    for column, name in enumerate(candidate.predictor.states):
        if name in places:
            states[:, column] = theirs.states[:, places[name]]
    if not np.all(np.isfinite(states)):
        return own
    whole = dataclasses.replace(mine, states=states, modes=theirs.modes)
    return dataclasses.replace(own, runs=dataclasses.replace(own.runs, whole=whole))
