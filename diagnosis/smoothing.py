"""Smoothing: the states of a model at each sample, from what was recorded before and after it.

A fixed-interval smoother in the modified Bryson-Frazier form (Bierman 1973, "Fixed interval
smoothing with discrete measurements", Int. J. Control 18, equations of section 3), which inverts no
covariance. It smooths the deviation from the run of the observer, whose mode is known at each
sample: one step of a Gauss-Newton search for the likeliest run (Bell 1994, SIAM J. Optim. 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate
from diagnosis.gains import Local, locals_of
from diagnosis.series import Series

Reals = NDArray[np.float64]
AROUND = 1.0
"""Seconds over which innovations are compared with what they should be."""
LARGEST = 1e12
"""A deviation beyond this is no model any more."""


@dataclass(frozen=True)
class Smoothed:
    """The states of a recording with their standard deviations [SI], (samples, states) each."""

    states: Reals
    stds: Reals


@dataclass(frozen=True)
class Steps:
    """What recordings, side by side, are smoothed from; those that ended see nothing any more.

    `missed` (samples, recordings, seen) by the observer's run, NaN where nothing is known, which
    `pushed` its states (samples, recordings, states); `phi`, `q` (samples, recordings, states,
    states) to the next sample, `c` (samples, recordings, seen, states).
    """

    missed: Reals
    pushed: Reals
    phi: Reals
    q: Reals
    c: Reals


@dataclass(frozen=True)
class _Correction:
    """One signal at one sample, each (recordings, ...): how it shows the states, over its variance
    where it is known; the gain; what was missed; what that squared is of its variance.
    """

    shown: Reals
    inverse: Reals
    gain: Reals
    missed: Reals
    ratio: Reals


def smoothed(estimate: Estimate, series: Sequence[Series]) -> list[Smoothed]:
    """Return the states of a model in each recording that it was fitted to.

    Standard deviations grow where the innovations around are larger than they should be.
    """
    candidate, noises = estimate.candidate, estimate.noises
    locals_ = locals_of(candidate, series, estimate.values(0), noises, estimate.outcome)
    if not locals_:
        raise ValueError("the model is unstable in every mode")
    steps = _steps(estimate, series, locals_)
    start = next(iter(locals_.values())).start
    after, spread, ratios = deviations(steps, start, noises.seen**2)
    found = []
    for r, run in enumerate(estimate.outcome.predictions):
        around = max(1, round(AROUND / float(series[r].period)))
        scale = np.sqrt(np.maximum(_mean_around(ratios[: run.done, :, r], around), 1.0))
        states = run.states[: run.done] - steps.pushed[: run.done, r] + after[: run.done, r]
        found.append(Smoothed(states, scale[:, None] * spread[: run.done, r]))
    return found


def _steps(estimate: Estimate, series: Sequence[Series], known: dict[int, Local]) -> Steps:
    runs, predictor = estimate.outcome.predictions, estimate.candidate.predictor
    shape = max(run.done for run in runs), len(runs)
    missed = np.full((*shape, len(predictor.seen)), np.nan)
    pushed = np.zeros((*shape, len(predictor.states)))
    places = np.zeros(shape, dtype=np.int64)
    modes, usual = list(predictor.modes), next(iter(known.values()))
    first, steady = estimate.gains.first, estimate.gains.steady
    for r, run in enumerate(runs):
        here = np.array([modes.index(int(mode)) for mode in run.modes[: run.done]])
        gains = steady[here]
        gains[: len(first)] = first[: len(gains)]
        missed[: run.done, r], places[: run.done, r] = run.innovations[: run.done], here
        pushed[: run.done, r] = np.einsum("kij,kj->ki", gains, np.nan_to_num(missed[: run.done, r]))
    each = [known.get(mode, usual) for mode in modes]
    phi, c = (
        np.array([getattr(one.linear, name) for one in each])[places] for name in ("phi", "c")
    )
    return Steps(missed, pushed, phi, np.array([one.q for one in each])[places], c)


def deviations(steps: Steps, start: Reals, noise: Reals) -> tuple[Reals, Reals, Reals]:
    """Return smoothed deviations from a run and their standard deviations, (samples, recordings,
    states) each, and what squared innovations are of their variances (samples, seen, recordings).

    From standard deviations `start` (states,), with variances `noise` (seen,) of what is seen.
    """
    before, covariances, corrections = _forward(steps, start, noise)
    after, spread = _backward(steps, before, covariances, corrections)
    return after, spread, np.array([[one.ratio for one in each] for each in corrections])


def _forward(
    steps: Steps, start: Reals, noise: Reals
) -> tuple[Reals, Reals, list[list[_Correction]]]:
    """Return the deviations and their covariances before each sample, and what corrected them.

    Signals correct one after the other; where one is not known its gain is 0. The deviation is from
    the run before its own correction, which is what it was pushed by.
    """
    samples, recordings, states = steps.pushed.shape
    means, covariances = np.empty(steps.pushed.shape), np.empty(steps.phi.shape)
    mean, p = np.zeros((recordings, states)), np.tile(np.diag(start**2), (recordings, 1, 1))
    found = []
    for k in range(samples):
        if k > 0:
            phi = steps.phi[k - 1]
            mean = _times(phi, mean)
            p = phi @ p @ phi.swapaxes(1, 2) + steps.q[k - 1]
        means[k], covariances[k] = mean, p
        corrections = []
        for j, variance in enumerate(noise):
            one = _correction(steps.c[k, :, j], steps.missed[k, :, j], mean, p, variance)
            mean = mean + one.gain * one.missed[:, None]
            p = p - one.gain[:, :, None] * _times(p, one.shown)[:, None, :]
            corrections.append(one)
        mean = mean - steps.pushed[k]
        found.append(corrections)
    return means, covariances, found


def _correction(shown: Reals, missed: Reals, mean: Reals, p: Reals, variance: float) -> _Correction:
    known = np.isfinite(missed)
    across = _times(p, shown)
    whole = _dot(shown, across) + variance
    inverse = np.where(known, 1.0 / whole, 0.0)
    left = np.where(known, missed - _dot(shown, mean), 0.0)
    ratio = np.where(known, left**2 / whole, np.nan)
    return _Correction(shown, inverse, across * inverse[:, None], left, ratio)


def _backward(
    steps: Steps, means: Reals, covariances: Reals, corrections: list[list[_Correction]]
) -> tuple[Reals, Reals]:
    """Return smoothed deviations and standard deviations, (samples, recordings, states) each."""
    samples, recordings, states = means.shape
    adjoint, information = np.zeros((recordings, states)), np.zeros((recordings, states, states))
    after, spread = np.empty(means.shape), np.empty(means.shape)
    for k in range(samples - 1, -1, -1):
        for one in reversed(corrections[k]):
            weight = one.inverse[:, None] * one.shown
            left = _dot(one.gain, adjoint) + one.missed * one.inverse
            adjoint = adjoint - one.shown * left[:, None]
            turned = _times(information, one.gain)
            both = one.shown[:, :, None] * turned[:, None, :]
            inner = _dot(one.gain, turned)[:, None] * one.shown + weight
            information = information - both - both.swapaxes(1, 2)
            information = information + one.shown[:, :, None] * inner[:, None, :]
        p = covariances[k]
        after[k] = means[k] - _times(p, adjoint)
        lost = np.sum((p @ information) * p, axis=2)
        spread[k] = np.sqrt(np.maximum(np.diagonal(p, axis1=1, axis2=2) - lost, 0.0))
        if k > 0:
            back = steps.phi[k - 1].swapaxes(1, 2)
            adjoint = _times(back, adjoint)
            information = back @ information @ steps.phi[k - 1]
    return after, spread


def _mean_around(ratios: Reals, around: int) -> Reals:
    """Return the mean (samples,) of what is known of `ratios` (samples, seen) around each."""
    window = np.ones(min(around, len(ratios)))
    known = np.isfinite(ratios)
    sums = np.convolve(np.sum(np.where(known, ratios, 0.0), axis=1), window, "same")
    counts = np.convolve(np.sum(known, axis=1), window, "same")
    return np.asarray(sums / np.maximum(counts, 1.0), dtype=np.float64)


def _times(matrices: Reals, vectors: Reals) -> Reals:
    return (matrices @ vectors[:, :, None])[:, :, 0]


def _dot(some: Reals, others: Reals) -> Reals:
    found: Reals = np.add.reduce(some * others, axis=1)
    return found
