"""Simulation: how far a model goes astray when nothing corrects it, before and after.

An observer runs for a second, then the model is alone for one and a half: the difference to what
was recorded there, over the spread of the recorded signal. A model that forgets where it started
is alone for the whole of each recording, once its states have been found.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import predict
from diagnosis.validation.misfit import Misfit

Reals = NDArray[np.float64]
OBSERVED_TIME = 1.0
"""Seconds in which the observer follows."""
FREE_TIME = 1.5
"""Seconds in which the model is alone."""


def compare_misfits(
    before: Estimate, after: Estimate, series: Sequence[SampledRecording]
) -> dict[str, Misfit]:
    """Return the misfit of each compared signal, of two models that are fitted to `series`."""
    first, second = nrmse(before, series), nrmse(after, series)
    names = before.candidate.predictor.outputs
    return {
        name: Misfit(float(a), float(b), float(a * scale), float(b * scale))
        for name, a, b, scale in zip(names, first, second, output_stds(series), strict=True)
    }


def nrmse(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
    """Return the normalised root mean square of free simulation by signal (seen,)."""
    squares, counts = [], []
    for one, simulated in zip(series, simulate_free(model, series), strict=True):
        counted = is_after_burn_in(one) if model.noise_levels.is_output_error else is_free(one)
        alone = counted[:, None] & np.isfinite(one.measured) & np.isfinite(simulated)
        error = np.where(alone, one.measured - simulated, 0.0)
        squares.append(np.sum(error**2, axis=0))
        counts.append(np.sum(alone, axis=0))
    mean = np.sum(squares, axis=0) / np.maximum(np.sum(counts, axis=0), 1)
    return np.asarray(np.sqrt(mean) / output_stds(series), dtype=np.float64)


def output_stds(series: Sequence[SampledRecording]) -> Reals:
    """Return the standard deviation of each compared signal [SI] (seen,)."""
    spread = np.nanstd(np.concatenate([one.measured for one in series]), axis=0)
    return np.asarray(np.maximum(spread, 1e-12), dtype=np.float64)


def simulate_free(model: Estimate, series: Sequence[SampledRecording]) -> list[Reals]:
    """Return what a model shows for each recording (samples, seen): followed, then alone."""
    masked = [
        dataclasses.replace(one, measured=np.where(is_free(one)[:, None], np.nan, one.measured))
        for one in series
    ]
    values = [model.values(k) for k in range(len(series))]
    masked = [
        dataclasses.replace(one, measured=np.ascontiguousarray(one.measured)) for one in masked
    ]
    prediction = predict(
        model.candidate, masked, values, model.gains, model.noise_levels.huber_limits
    )
    return [p.outputs for p in prediction.predictions]


def is_after_burn_in(series: SampledRecording) -> NDArray[np.bool_]:
    """Return the samples (samples,) behind those in which the states are found."""
    return np.asarray(np.arange(series.count) >= burn_in_samples(series))


def is_free(series: SampledRecording) -> NDArray[np.bool_]:
    """Return the samples (samples,) at which the model is alone."""
    time = np.arange(series.count) * float(series.period)
    return np.asarray(np.mod(time, OBSERVED_TIME + FREE_TIME) >= OBSERVED_TIME)
