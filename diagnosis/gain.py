"""Gain: the steady Kalman gain of a model that is linearised by differences, mode by mode.

x(k+1) = Phi x(k) + w, y(k) = C x(k) + v, with w of covariance Q and v of R; the gain is that of the
discrete Riccati equation by structure-preserving doubling (Chu, Fan, Lin 2005).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.predictor import Predictor

Reals = NDArray[np.float64]
DOUBLINGS = 60
"""Most doublings: 2^60 samples; usually 10 to 20 are needed."""
CLOSE = 1e-10
"""Two covariances that differ by less, of their largest entry, are the same."""
LARGEST = 1e12
"""A difference quotient beyond this is no model any more."""
SMALLEST = 1e-9
"""Differences are at least this large: 1e7 times the rounding of a state near 1."""


@dataclass(frozen=True)
class Linear:
    """A model near a point: `phi` (states, states), `c` (seen, states), `b` (states, inputs)."""

    phi: Reals
    c: Reals
    b: Reals


def linearised(
    predictor: Predictor,
    page: Reals,
    inputs: Reals,
    mode: int,
    substeps: int,
    at: Reals,
    sizes: Reals,
) -> Linear | None:
    """Return the model over one sample near `at` by central differences of `sizes` (states,).

    None where it leaves all bounds within the sample.
    """
    count = len(at)
    ahead, shown = np.empty((count, count)), np.empty((len(predictor.seen), count))
    for column in range(count):
        size = max(sizes[column], SMALLEST)
        step = np.zeros(count)
        step[column] = size
        high, seen_high = predictor.advance(page, inputs, mode, substeps, at + step)
        low, seen_low = predictor.advance(page, inputs, mode, substeps, at - step)
        ahead[:, column] = (high - low) / (2.0 * size)
        shown[:, column] = (seen_high - seen_low) / (2.0 * size)
    b = np.empty((count, len(inputs)))
    for column in range(len(inputs)):
        step = np.zeros(len(inputs))
        step[column] = max(1e-4 * abs(inputs[column]), 1e-4)
        high, _ = predictor.advance(page, inputs + step, mode, substeps, at)
        low, _ = predictor.advance(page, inputs - step, mode, substeps, at)
        b[:, column] = (high - low) / (2.0 * step[column])
    if not np.max(np.abs(np.hstack([ahead, b]))) < LARGEST:
        return None
    return Linear(ahead, shown @ np.linalg.pinv(ahead), b)


def steady_gain(linear: Linear, q: Reals, r: Reals) -> Reals | None:
    """Return the gain (states, seen) of process noise `q` and measurement noise `r`.

    None where there is no steady covariance.
    """
    phi, c = linear.phi, linear.c
    a, g, h = phi.T.copy(), c.T @ np.linalg.solve(r, c), q.copy()
    unit = np.eye(len(phi))
    for _ in range(DOUBLINGS):
        try:
            w = np.linalg.inv(unit + g @ h)
        except np.linalg.LinAlgError:
            return None
        aw = a @ w
        change = a.T @ h @ w @ a
        g = g + aw @ g @ a.T
        a = aw @ a
        h = h + change
        h = 0.5 * (h + h.T)
        if not np.all(np.isfinite(h)):
            return None
        if np.max(np.abs(change)) <= CLOSE * np.max(np.abs(h)):
            break
    return _gain(h, c, r)


def first_gains(linear: Linear, q: Reals, r: Reals, start: Reals, count: int) -> Reals:
    """Return the gains (count, states, seen) of the first samples, from a covariance `start`."""
    covariance, found = start, []
    unit = np.eye(len(start))
    for _ in range(count):
        covariance = linear.phi @ covariance @ linear.phi.T + q
        gain = _gain(covariance, linear.c, r)
        rest = unit - gain @ linear.c
        covariance = rest @ covariance @ rest.T + gain @ r @ gain.T
        found.append(gain)
    return np.ascontiguousarray(np.array(found).reshape(count, len(start), len(r)))


def _gain(covariance: Reals, c: Reals, r: Reals) -> Reals:
    cross = covariance @ c.T
    return np.asarray(np.linalg.solve((c @ cross + r).T, cross.T).T, dtype=np.float64)
