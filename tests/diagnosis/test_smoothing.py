"""Smoothing gives what Kalman's smoother gives, with standard deviations that are right."""

from __future__ import annotations

import dataclasses

import numpy as np
from filterpy.kalman import KalmanFilter, rts_smoother

from diagnosis.bench import Bench
from diagnosis.estimate import looked_at
from diagnosis.joined import burnt
from diagnosis.level import units_of
from diagnosis.point import point_of
from diagnosis.prediction import noises_of
from diagnosis.smoothing import Steps, deviations, smoothed
from tests.diagnosis.test_estimation import TRUTH, bench, recorded

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
    steps = Steps(missed[:, None], pushed[:, None], *sides)
    after, spread, _ = deviations(steps, start, noise)
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


def test_a_drift_lies_within_its_standard_deviations_as_often_as_it_should(bench: Bench) -> None:
    candidate = bench.candidate(())
    place = candidate.predictor.states.index(DRIFT)
    memory = candidate.recipe.memories[candidate.drifts.index(DRIFT)]
    series, truths = [], []
    rng = np.random.default_rng(3)
    for blank in recorded(candidate, TRUTH):
        kept = np.exp(-float(blank.period) / memory)
        pushes = np.zeros((blank.count, len(candidate.spans)))
        pushes[:, place] = rng.normal(0.0, LEVEL * np.sqrt(1.0 - kept**2), blank.count)
        nothing = np.zeros((len(candidate.predictor.modes), len(candidate.spans), 2))
        run = candidate.predictor.predict(
            candidate.page(TRUTH, blank),
            blank.inputs,
            blank.measured,
            nothing[:0],
            nothing,
            candidate.recipe.substeps,
            linear=False,
            pushes=pushes,
        )
        measured = run.seen + rng.normal(0.0, [0.05, 0.01], run.seen.shape)
        series.append(dataclasses.replace(blank, measured=np.ascontiguousarray(measured)))
        truths.append(run.states[:, place])
    noises = dataclasses.replace(noises_of(series, {}), seen=np.array([0.05, 0.01]))
    units = units_of(candidate, series, TRUTH)
    noises = dataclasses.replace(noises, drifts=dict.fromkeys(units, 0.0) | {DRIFT: LEVEL})
    model = looked_at(candidate, series, noises, point_of(candidate, len(series), TRUTH))
    far = []
    for one, truth, found in zip(series, truths, smoothed(model, series), strict=True):
        rows = slice(burnt(one), None)
        far.append((found.states[rows, place] - truth[rows]) / found.stds[rows, place])
        late = model.outcome.predictions[len(far) - 1].states[rows, place] - truth[rows]
        missed = found.states[rows, place] - truth[rows]
        assert np.sqrt(np.mean(missed**2)) < 0.8 * np.sqrt(np.mean(late**2))
    whole = np.abs(np.concatenate(far))
    assert 0.6 < np.mean(whole < 1.0) < 0.8
    assert np.mean(whole < 3.0) > 0.985
