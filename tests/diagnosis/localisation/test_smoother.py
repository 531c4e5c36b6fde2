"""Smoothing gives what Kalman's smoother gives, with standard deviations that are right."""

from __future__ import annotations

import dataclasses

import numpy as np
from filterpy.kalman import KalmanFilter, rts_smoother

from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import evaluate
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units
from diagnosis.localisation.smoother import SmootherInput, smooth_deviations, smooth_states
from diagnosis.model.parameter_vector import vector_of
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings

__all__ = ["bench"]
SAMPLES, STATES, SEEN = 60, 3, 2
DRIFT = "drift_balance_w_w"
LEVEL = 30.0


def test_deviations_from_any_run_are_those_of_an_independent_smoother() -> None:
    rng = np.random.default_rng(5)
    phi = np.array([[0.9, 0.1, 0.0], [-0.2, 0.95, 0.1], [0.0, 0.0, 0.99]])
    c = np.array([[1.0, 0.0, 0.0], [0.2, 1.0, 0.0]])
    q, noise, start = np.diag([1e-4, 1e-4, 0.02]), np.array([0.04, 0.09]), np.full(STATES, 0.5)
    seen = rng.normal(size=(SAMPLES, SEEN)).cumsum(axis=0)
    seen[rng.random((SAMPLES, SEEN)) < 0.3] = np.nan
    gain = rng.uniform(0.0, 0.3, (STATES, SEEN))
    before, pushed, missed = np.zeros((SAMPLES, STATES)), np.zeros((SAMPLES, STATES)), seen.copy()
    for k in range(SAMPLES):
        before[k] = phi @ (before[k - 1] + pushed[k - 1]) if k else 0.0
        missed[k] = seen[k] - c @ before[k]
        pushed[k] = gain @ np.nan_to_num(missed[k])
    sides = [np.broadcast_to(one, (SAMPLES, 1, *one.shape)) for one in (phi, q, c)]
    steps = SmootherInput(missed[:, None], pushed[:, None], *sides)
    after, spread, _ = smooth_deviations(steps, start, noise)
    means, covariances = _by_filterpy(phi, c, q, noise, start, seen)
    assert np.allclose(before + after[:, 0], means, rtol=0.0, atol=1e-9)
    stds = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    assert np.allclose(spread[:, 0], stds, rtol=1e-7, atol=0.0)


def _by_filterpy(
    phi: np.ndarray,
    c: np.ndarray,
    q: np.ndarray,
    noise: np.ndarray,
    start: np.ndarray,
    seen: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return filterpy's states (samples, states) and covariances, from forward and backward."""
    one = KalmanFilter(dim_x=STATES, dim_z=SEEN)
    one.F, one.Q, one.P = phi, q, np.diag(start**2)
    means, covariances = [], []
    for k, values in enumerate(seen):
        if k > 0:
            one.predict()
        known = np.isfinite(values)
        if known.any():
            one.update(values[known][:, None], R=np.diag(noise[known]), H=c[known])
        means.append(one.x.copy())
        covariances.append(one.P.copy())
    found = rts_smoother(np.array(means), np.array(covariances), [phi] * SAMPLES, [q] * SAMPLES)
    return found[0][:, :, 0], found[1]


def test_a_drift_lies_within_its_standard_deviations_as_often_as_it_should(bench: ModelSet) -> None:
    candidate = bench.compile_candidate(())
    place = candidate.predictor.states.index(DRIFT)
    memory = candidate.compiled.memories[candidate.disturbance_states.index(DRIFT)]
    series, truths = [], []
    rng = np.random.default_rng(3)
    for blank in simulate_recordings(candidate, TRUTH):
        kept = np.exp(-float(blank.period) / memory)
        pushes = np.zeros((blank.count, len(candidate.state_ranges)))
        pushes[:, place] = rng.normal(0.0, LEVEL * np.sqrt(1.0 - kept**2), blank.count)
        nothing = np.zeros((len(candidate.predictor.modes), len(candidate.state_ranges), 2))
        run = candidate.predictor.predict(
            candidate.calibration_page(TRUTH, blank),
            blank.inputs,
            blank.measured,
            nothing[:0],
            nothing,
            candidate.compiled.substeps,
            linear_inputs=blank.linear_inputs,
            state_increments=pushes,
        )
        measured = run.outputs + rng.normal(0.0, [0.05, 0.01], run.outputs.shape)
        series.append(dataclasses.replace(blank, measured=np.ascontiguousarray(measured)))
        truths.append(run.states[:, place])
    noises = dataclasses.replace(measured_noise_levels(series, {}), outputs=np.array([0.05, 0.01]))
    units = disturbance_units(candidate, series, TRUTH)
    noises = dataclasses.replace(noises, process=dict.fromkeys(units, 0.0) | {DRIFT: LEVEL})
    model = evaluate(candidate, series, noises, vector_of(candidate, len(series), TRUTH))
    far = []
    for one, truth, found in zip(series, truths, smooth_states(model, series), strict=True):
        rows = slice(burn_in_samples(one), None)
        far.append((found.states[rows, place] - truth[rows]) / found.stds[rows, place])
        late = model.prediction.predictions[len(far) - 1].states[rows, place] - truth[rows]
        missed = found.states[rows, place] - truth[rows]
        assert np.sqrt(np.mean(missed**2)) < 0.8 * np.sqrt(np.mean(late**2))
    whole = np.abs(np.concatenate(far))
    assert 0.6 < np.mean(whole < 1.0) < 0.8
    assert np.mean(whole < 3.0) > 0.985
