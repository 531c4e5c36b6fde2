"""Smoother: states of a model at each sample, from all measurements before and after it.

It is a fixed-interval smoother in modified Bryson-Frazier form, which inverts no covariance
(Bierman 1973, "Fixed interval smoothing with discrete measurements", Int. J. Control 18, section
3). It smooths the deviation from the run of the observer, whose mode is known at each sample. This
is one Gauss-Newton step towards the most likely trajectory (Bell 1994, SIAM J. Optim. 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording, UnusableRecordingError
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.kalman_gain import LocalModel, local_models

AVERAGING_TIME = 5.0
"""Reference times over which normalised squared innovations are averaged."""


@dataclass(frozen=True)
class SmoothedStates:
    """The smoothed states of a recording with standard deviations [SI], (samples, states) each."""

    states: Reals
    stds: Reals


@dataclass(frozen=True)
class SmootherInput:
    """The data of recordings that are smoothed in parallel; a recording that has ended is NaN.

    `innovations` (samples, recordings, outputs) are NaN where unknown; `corrections` (samples,
    recordings, states) are the observer's updates. `phi` and `q` (samples, recordings, states,
    states) lead to the next sample; `c` is (samples, recordings, outputs, states).
    """

    innovations: Reals
    corrections: Reals
    phi: Reals
    q: Reals
    c: Reals


@dataclass(frozen=True)
class _MeasurementUpdate:
    """The update by one output at one sample; each array begins with the axis of recordings."""

    output_row: Reals
    inverse_variance: Reals
    gain: Reals
    innovation: Reals
    normalised_square: Reals


def smooth_states(estimate: Estimate, series: Sequence[SampledRecording]) -> list[SmoothedStates]:
    """Return the smoothed states of each recording to which a model was fitted.

    The standard deviations are scaled by the mean normalised square of innovations over
    `AVERAGING_TIME`, where that exceeds 1. Samples after a run diverged are left out. Raises
    UnusableRecordingError if the model is unstable in every mode.
    """
    candidate, noise_levels = estimate.candidate, estimate.noise_levels
    locals_ = local_models(candidate, series, estimate.values(0), noise_levels, estimate.prediction)
    if not locals_:
        raise UnusableRecordingError(f"{series[0].name}: the model is unstable in every mode")
    steps = _smoother_input(estimate, locals_)
    start = next(iter(locals_.values())).initial_std
    after, spread, ratios = smooth_deviations(steps, start, noise_levels.outputs**2)
    result = []
    for r, run in enumerate(estimate.prediction.predictions):
        rows = slice(run.completed)
        around = series[r].sample_count(AVERAGING_TIME)
        scale = np.sqrt(np.maximum(_moving_mean(ratios[rows, :, r], around), 1.0))
        states = run.states[rows] - steps.corrections[rows, r] + after[rows, r]
        result.append(SmoothedStates(states, scale[:, None] * spread[rows, r]))
    return result


def _smoother_input(estimate: Estimate, models: dict[int, LocalModel]) -> SmootherInput:
    """Return the innovations, corrections and linear models at each sample of all recordings."""
    runs, predictor = estimate.prediction.predictions, estimate.candidate.predictor
    shape = max(run.completed for run in runs), len(runs)
    innovations = np.full((*shape, len(predictor.outputs)), np.nan)
    corrections = np.zeros((*shape, len(predictor.states)))
    places = np.zeros(shape, dtype=np.int64)
    modes, default_model = list(predictor.modes), next(iter(models.values()))
    first, steady = estimate.gains.transient, estimate.gains.steady_state
    for r, run in enumerate(runs):
        rows = slice(run.completed)
        places[rows, r] = [modes.index(int(mode)) for mode in run.modes[rows]]
        gains = steady[places[rows, r]]
        gains[: len(first)] = first[: len(gains)]
        innovations[rows, r] = run.innovations[rows]
        corrections[rows, r] = np.einsum("kij,kj->ki", gains, np.nan_to_num(innovations[rows, r]))
    by_mode = [models.get(mode, default_model) for mode in modes]
    phi = np.array([one.linear.phi for one in by_mode])[places]
    c = np.array([one.linear.c for one in by_mode])[places]
    q = np.array([one.q for one in by_mode])[places]
    return SmootherInput(innovations, corrections, phi, q, c)


def smooth_deviations(
    data: SmootherInput, initial_std: Reals, noise_variances: Reals
) -> tuple[Reals, Reals, Reals]:
    """Return smoothed deviations and standard deviations, (samples, recordings, states) each.

    The third result are normalised squares (samples, outputs, recordings). `initial_std` (states,)
    and `noise_variances` (outputs,) are those of start and measurements.
    """
    before, covariances, corrections = _forward_pass(data, initial_std, noise_variances)
    after, spread = _backward_pass(data, before, covariances, corrections)
    squares = np.array([[one.normalised_square for one in each] for each in corrections])
    return after, spread, squares


def _forward_pass(
    data: SmootherInput, initial_std: Reals, noise_variances: Reals
) -> tuple[Reals, Reals, list[list[_MeasurementUpdate]]]:
    """Return deviations and covariances before each sample, and sequential Kalman updates.

    The deviation is measured from the run before the observer's own correction.
    """
    samples, recordings, states = data.corrections.shape
    means, covariances = np.empty(data.corrections.shape), np.empty(data.phi.shape)
    mean, p = np.zeros((recordings, states)), np.tile(np.diag(initial_std**2), (recordings, 1, 1))
    updates = []
    for k in range(samples):
        if k > 0:
            phi = data.phi[k - 1]
            mean = _batch_matvec(phi, mean)
            p = phi @ p @ phi.swapaxes(1, 2) + data.q[k - 1]
        means[k], covariances[k] = mean, p
        sample_updates = []
        for j, variance in enumerate(noise_variances):
            one = _measurement_update(data.c[k, :, j], data.innovations[k, :, j], mean, p, variance)
            mean = mean + one.gain * one.innovation[:, None]
            p = p - one.gain[:, :, None] * _batch_matvec(p, one.output_row)[:, None, :]
            sample_updates.append(one)
        mean = mean - data.corrections[k]
        updates.append(sample_updates)
    return means, covariances, updates


def _measurement_update(
    output_row: Reals, innovation: Reals, mean: Reals, p: Reals, variance: float
) -> _MeasurementUpdate:
    """Return the Kalman update of one output, with gain 0 where it is unknown."""
    known = np.isfinite(innovation)
    across = _batch_matvec(p, output_row)
    whole = _batch_dot(output_row, across) + variance
    inverse = np.where(known, 1.0 / whole, 0.0)
    left = np.where(known, innovation - _batch_dot(output_row, mean), 0.0)
    ratio = np.where(known, left**2 / whole, np.nan)
    return _MeasurementUpdate(output_row, inverse, across * inverse[:, None], left, ratio)


def _backward_pass(
    data: SmootherInput,
    means: Reals,
    covariances: Reals,
    corrections: list[list[_MeasurementUpdate]],
) -> tuple[Reals, Reals]:
    """Return smoothed deviations and standard deviations, (samples, recordings, states) each."""
    samples, recordings, states = means.shape
    adjoint, information = np.zeros((recordings, states)), np.zeros((recordings, states, states))
    after, spread = np.empty(means.shape), np.empty(means.shape)
    for k in range(samples - 1, -1, -1):
        for one in reversed(corrections[k]):
            weight = one.inverse_variance[:, None] * one.output_row
            left = _batch_dot(one.gain, adjoint) + one.innovation * one.inverse_variance
            adjoint = adjoint - one.output_row * left[:, None]
            information_gain = _batch_matvec(information, one.gain)
            cross_terms = one.output_row[:, :, None] * information_gain[:, None, :]
            inner = _batch_dot(one.gain, information_gain)[:, None] * one.output_row + weight
            information = information - cross_terms - cross_terms.swapaxes(1, 2)
            information = information + one.output_row[:, :, None] * inner[:, None, :]
        p = covariances[k]
        after[k] = means[k] - _batch_matvec(p, adjoint)
        variance_reduction = np.sum((p @ information) * p, axis=2)
        spread[k] = np.sqrt(np.maximum(np.diagonal(p, axis1=1, axis2=2) - variance_reduction, 0.0))
        if k > 0:
            back = data.phi[k - 1].swapaxes(1, 2)
            adjoint = _batch_matvec(back, adjoint)
            information = back @ information @ data.phi[k - 1]
    return after, spread


def _moving_mean(ratios: Reals, width: int) -> Reals:
    """Return the moving mean (samples,) over all known `ratios` (samples, outputs)."""
    window = np.ones(min(width, len(ratios)))
    known = np.isfinite(ratios)
    sums = np.convolve(np.sum(np.where(known, ratios, 0.0), axis=1), window, "same")
    counts = np.convolve(np.sum(known, axis=1), window, "same")
    return np.asarray(sums / np.maximum(counts, 1.0), dtype=np.float64)


def _batch_matvec(matrices: Reals, vectors: Reals) -> Reals:
    """Return the product of each matrix with its vector."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def _batch_dot(first: Reals, second: Reals) -> Reals:
    """Return the scalar product of each pair of vectors."""
    found: Reals = np.add.reduce(first * second, axis=1)
    return found
