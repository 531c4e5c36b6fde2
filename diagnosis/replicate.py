"""Replicate: recordings as the recalibrated base would have given them, from random numbers.

The base runs freely over the inputs that were recorded, from where each recording starts, with the
slow torques that its drifts stand for; signals and inputs get new noise and are quantised.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidate import Candidate
from diagnosis.estimation import Estimate
from diagnosis.noise import quantum_of
from diagnosis.prediction import Noises
from diagnosis.series import Series

Reals = NDArray[np.float64]


def replicate(
    model: Candidate,
    base: Estimate,
    series: Sequence[Series],
    noises: Noises,
    random: np.random.Generator,
) -> tuple[Series, ...] | None:
    """Return simulated recordings on the grid of `series`, None where the base leaves all bounds.

    `model` is the base compiled for that grid, `noises` are those of the recordings on it.
    """
    found = []
    none = np.zeros((len(model.predictor.modes), len(model.predictor.states), len(noises.seen)))
    for place, one in enumerate(series):
        run = model.predictor.predict(
            model.page(base.values(place), one),
            one.inputs,
            one.measured,
            none[:0],
            none,
            model.recipe.substeps,
            one.is_linear,
            _pushes(model, base.noises, one, random),
        )
        if run.done < one.count:
            return None
        shown = np.where(np.isfinite(one.measured), run.seen, np.nan)
        measured = _noisy(shown, one.measured, noises.seen, random)
        inputs = _noisy(one.inputs, one.inputs, noises.inputs, random)
        found.append(dataclasses.replace(one, inputs=inputs, measured=measured))
    return tuple(found)


def _pushes(model: Candidate, noises: Noises, one: Series, random: np.random.Generator) -> Reals:
    """Return what is added to each state after each sample (samples, states): drifts move."""
    pushes = np.zeros((one.count, len(model.predictor.states)))
    for name, memory in zip(model.drifts, model.recipe.memories, strict=True):
        kept = np.exp(-float(one.period) / memory)
        size = noises.drifts.get(name, 0.0)
        steps = size * np.sqrt(1.0 - kept**2) * random.standard_normal(one.count)
        steps[0] = size * random.standard_normal()
        pushes[:, model.predictor.states.index(name)] = steps
    return pushes


def _noisy(values: Reals, like: Reals, noise: Reals, random: np.random.Generator) -> Reals:
    """Return signals (samples, signals) with noise, in the quanta of those that they are like."""
    found = values.copy()
    for column, size in enumerate(noise):
        known = like[:, column][np.isfinite(like[:, column])]
        quantum = quantum_of(known)
        white = np.sqrt(max(float(size) ** 2 - quantum**2 / 12.0, 0.0))
        found[:, column] += white * random.standard_normal(len(found))
        if quantum > 0.0:
            found[:, column] = quantum * np.round(found[:, column] / quantum)
    return np.ascontiguousarray(found)
