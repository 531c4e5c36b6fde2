"""Replicates: simulated recordings of the recalibrated base with random noise.

The base is simulated under denoised recorded inputs from the start of each recording, with random
disturbances. Outputs and inputs get new noise and quantisation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.noise_estimate import NOISE_QUANTILE, WINDOW_SAMPLES, quantum_of
from diagnosis.data.sampled_recording import DECIMATED_PERIOD, SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import NoiseLevels
from diagnosis.model.candidate import Candidate

Reals = NDArray[np.float64]
MEDIAN_SAMPLES = 9
"""Samples of the median that takes the noise from an input."""


def simulate_replicate(
    model: Candidate,
    base: Estimate,
    series: Sequence[SampledRecording],
    random: np.random.Generator,
) -> tuple[SampledRecording, ...] | None:
    """Return simulated recordings on the grid of `series`, or None if the base diverges.

    `model` is the base compiled for that grid. The first inputs are the recorded ones, because
    their sign can determine the side of a gap at which a shaft starts.
    """
    found = []
    predictor = model.predictor
    none = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.outputs)))
    for place, one in enumerate(series):
        begun = max(1, int(DECIMATED_PERIOD / one.period))
        calm = np.ascontiguousarray(
            np.stack([_denoise_input(column) for column in one.inputs.T], axis=1)
        )
        calm[:begun] = np.mean(one.inputs[:begun], axis=0)
        run = predictor.predict(
            model.calibration_page(base.values(place), one),
            calm,
            one.measured,
            none[:0],
            none,
            model.compiled.substeps,
            one.is_first_order_hold,
            _disturbance_steps(model, base.noise_levels, one, random),
        )
        if run.completed < one.count:
            return None
        shown = np.where(np.isfinite(one.measured), run.outputs, np.nan)
        measured = _add_noise(shown, one.measured, random)
        inputs = _add_noise(calm, one.inputs, random)
        inputs[:begun] = one.inputs[:begun]
        found.append(dataclasses.replace(one, inputs=inputs, measured=measured))
    return tuple(found)


def _disturbance_steps(
    model: Candidate,
    noise_levels: NoiseLevels,
    series: SampledRecording,
    random: np.random.Generator,
) -> Reals:
    """Return what is added to each state after each sample (samples, states): drifts move."""
    pushes = np.zeros((series.count, len(model.predictor.states)))
    for name, memory in zip(model.disturbance_states, model.compiled.memories, strict=True):
        kept = np.exp(-float(series.period) / memory)
        size = noise_levels.process.get(name, 0.0)
        steps = size * np.sqrt(1.0 - kept**2) * random.standard_normal(series.count)
        steps[0] = size * random.standard_normal()
        pushes[:, model.predictor.states.index(name)] = steps
    return pushes


def _denoise_input(values: Reals) -> Reals:
    """Return an input without its noise; steps stay. In a gap noise alone would move a shaft."""
    if _noise_std(values) == 0.0:
        return values
    from scipy.ndimage import median_filter  # slow to load

    return np.asarray(median_filter(values, MEDIAN_SAMPLES, mode="nearest"), dtype=np.float64)


def _add_noise(values: Reals, recorded: Reals, random: np.random.Generator) -> Reals:
    """Return signals (samples, signals) with noise, in the quanta of those that they are like."""
    found = values.copy()
    for column in range(found.shape[1]):
        known = recorded[:, column][np.isfinite(recorded[:, column])]
        quantum = quantum_of(known)
        white = np.sqrt(max(_noise_std(known) ** 2 - quantum**2 / 12.0, 0.0))
        found[:, column] += white * random.standard_normal(len(found))
        if quantum > 0.0:
            found[:, column] = quantum * np.round(found[:, column] / quantum)
    return np.ascontiguousarray(found)


def _noise_std(values: Reals) -> float:
    """Return the standard deviation of the noise of a signal, that of its quanta in it.

    By mean squares of second differences: their median is one of a few values where quanta are
    as large as noise.
    """
    second = np.diff(values, n=2)
    if len(second) == 0:
        return 0.0
    parts = np.array_split(second, max(1, len(second) // WINDOW_SAMPLES))
    return float(np.quantile([np.sqrt(np.mean(part**2) / 6.0) for part in parts], NOISE_QUANTILE))
