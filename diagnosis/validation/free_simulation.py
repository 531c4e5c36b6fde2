"""Free simulation: the error of a model without corrections, before and after a diagnosis.

An observer corrects the model for one second, then it runs freely for one and a half. A model with
fading memory runs freely after the burn-in.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import predict

OBSERVED_TIME = 5.0
"""Reference times of a recording with corrections by the observer."""
FREE_TIME = 7.5
"""Reference times of free simulation."""
WINDOW_TIME = OBSERVED_TIME + FREE_TIME


def compare_misfits(
    before: Estimate, after: Estimate, series: Sequence[SampledRecording]
) -> dict[str, Misfit]:
    """Return the misfit by `nrmse` and in SI of each output for two models fitted to `series`."""
    first, second = nrmse(before, series), nrmse(after, series)
    names = before.candidate.predictor.outputs
    return {
        name: Misfit(float(a), float(b), float(a * scale), float(b * scale))
        for name, a, b, scale in zip(names, first, second, output_stds(series), strict=True)
    }


def nrmse(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
    """Return the error of free simulation over the standard deviation (outputs,), 0 if unknown.

    Known values in free parts count; with the output-error criterion all after the burn-in.
    """
    return _nrmse_of(model, series, simulate_free(model, series))


def complete_nrmse(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
    """Return `nrmse`, infinite for each output of a model of which a run diverges (outputs,)."""
    runs = simulate_free(model, series)
    size = _nrmse_of(model, series, runs)
    return size if all(np.all(np.isfinite(run)) for run in runs) else np.full_like(size, np.inf)


def _nrmse_of(model: Estimate, series: Sequence[SampledRecording], runs: Sequence[Reals]) -> Reals:
    """Return the `nrmse` of simulated outputs, (samples, outputs) of each recording."""
    squares, counts = [], []
    for one, simulated in zip(series, runs, strict=True):
        after_burn_in = np.arange(one.count) >= burn_in_samples(one)
        counted = after_burn_in if model.noise_levels.is_output_error else is_free(one)
        alone = counted[:, None] & np.isfinite(one.measured) & np.isfinite(simulated)
        error = np.where(alone, one.measured - simulated, 0.0)
        squares.append(np.sum(error**2, axis=0))
        counts.append(np.sum(alone, axis=0))
    mean = np.sum(squares, axis=0) / np.maximum(np.sum(counts, axis=0), 1)
    return np.asarray(np.sqrt(mean) / output_stds(series), dtype=np.float64)


def output_stds(series: Sequence[SampledRecording]) -> Reals:
    """Return the standard deviation [SI] of each output (outputs,), at least 1e-12."""
    spread = np.nanstd(np.concatenate([one.measured for one in series]), axis=0)
    return np.asarray(np.maximum(spread, 1e-12), dtype=np.float64)


def simulate_free(model: Estimate, series: Sequence[SampledRecording]) -> list[Reals]:
    """Return the outputs of a model, observed and free in turn, (samples, outputs) each.

    Samples after a run diverged are NaN.
    """
    measured = [np.where(is_free(one)[:, None], np.nan, one.measured) for one in series]
    masked = [
        dataclasses.replace(one, measured=np.ascontiguousarray(known))
        for one, known in zip(series, measured, strict=True)
    ]
    values = [model.values(k) for k in range(len(series))]
    run = predict(model.candidate, masked, values, model.gains, model.noise_levels.huber_limits)
    return [one.outputs for one in run.predictions]


def is_free(series: SampledRecording) -> NDArray[np.bool_]:
    """Return the mask (samples,) of the last `FREE_TIME` of each `WINDOW_TIME`."""
    observed, whole = series.sample_count(OBSERVED_TIME), series.sample_count(WINDOW_TIME)
    return np.asarray(np.mod(np.arange(series.count), whole) >= observed)


@dataclass(frozen=True)
class Misfit:
    """Errors of free simulation before and after, over the signal's deviation and in SI."""

    nrmse_before: float
    nrmse_after: float
    rmse_before: float
    rmse_after: float
