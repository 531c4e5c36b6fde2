"""Normal: the normal equations of a fit, recording by recording, and their solution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidate import Candidate
from diagnosis.point import Point, bounds_of, is_own
from diagnosis.prediction import Outcome

Reals = NDArray[np.float64]
STEP = 2e-3
"""Change of a coordinate for a difference, in standard deviations of its prior."""


@dataclass(frozen=True)
class Normal:
    """`a` (recordings, n, n) and `g` (recordings, n): J'J and J'e over the mean squares, without
    priors; `own` (n,) tells which coordinates each recording has of its own.
    """

    a: Reals
    g: Reals
    own: NDArray[np.bool_]

    def without(self, recording: int) -> Normal:
        """Return the equations of the other recordings."""
        kept = np.arange(len(self.a)) != recording
        return Normal(self.a[kept], self.g[kept], self.own)


def normal_of(
    candidate: Candidate, point: Point, outcome: Outcome, run: Callable[[Point], Outcome]
) -> Normal:
    """Return the normal equations at a point, by forward differences of `run`."""
    count = len(candidate.uncertain)
    jacobians: list[Sequence[Reals]] = []
    for k in range(count):
        ahead = point.moved(candidate, k, STEP)
        size = float(ahead.shared[k] - point.shared[k])
        seen = run(ahead).innovations
        jacobians.append([(a - b) / size for a, b in zip(seen, outcome.innovations, strict=True)])
    scale = 1.0 / outcome.variances()
    a = np.zeros((len(outcome.innovations), count, count))
    g = np.zeros((len(outcome.innovations), count))
    for r, innovation in enumerate(outcome.innovations):
        known = np.isfinite(innovation)
        far = np.maximum(np.abs(innovation) / outcome.limits, 1.0)
        jacobian = np.array([np.where(known, one[r], 0.0) for one in jacobians])
        weighted = (jacobian * np.where(known, scale / far, 0.0)).reshape(count, -1)
        a[r] = weighted @ jacobian.reshape(count, -1).T
        g[r] = weighted @ np.where(known, innovation, 0.0).reshape(-1)
    return Normal(a, g, is_own(candidate))


def stepped(
    candidate: Candidate,
    point: Point,
    normal: Normal,
    damping: float,
    own_only: bool = False,
) -> Point:
    """Return the point one damped step further, within the ranges.

    A coordinate at its bound that the step would lead out of its range is held (active set).
    `normal` may lack recordings: their own coordinates stay.
    """
    bounds = bounds_of(candidate)
    held = np.full(len(point.shared), own_only)
    step = _solved(point, normal, damping, held)
    for _ in held:
        trial = point.shared + step.shared
        out = (trial <= bounds[:, 0]) & (point.shared <= bounds[:, 0])
        out |= (trial >= bounds[:, 1]) & (point.shared >= bounds[:, 1])
        out &= ~normal.own & ~held
        if not np.any(out):
            break
        held |= out
        step = _solved(point, normal, damping, held)
    shared = np.clip(point.shared + step.shared, bounds[:, 0], bounds[:, 1])
    own = np.clip(point.own + step.own, bounds[:, 0], bounds[:, 1])
    return Point(shared, own)


def foreseen(point: Point, normal: Normal) -> float:
    """Return what one full step would gain [nats], priors included (Rao's score)."""
    step = _solved(point, normal, 0.0, np.zeros(len(point.shared), dtype=bool))
    free = ~normal.own
    right = normal.g.sum(axis=0)[free] + point.shared[free]
    gain = -0.5 * float(right @ step.shared[free])
    for r in range(len(normal.a)):
        rest = normal.g[r][normal.own] + point.own[r, normal.own]
        gain -= 0.5 * float(rest @ step.own[r, normal.own])
    return gain


def _solved(point: Point, normal: Normal, damping: float, held: NDArray[np.bool_]) -> Point:
    """Solve for a step: coordinates of one recording are eliminated before the shared ones."""
    own, free = normal.own, ~normal.own & ~held
    matrix = np.eye(int(free.sum()))
    right = -point.shared[free]
    parts: list[tuple[Reals, Reals, Reals]] = []
    for r, (a, g) in enumerate(zip(normal.a, normal.g, strict=True)):
        matrix = matrix + a[np.ix_(free, free)]
        right = right - g[free]
        if np.any(own):
            inner = a[np.ix_(own, own)]
            inner = inner + np.eye(len(inner)) + damping * np.diag(np.diag(inner))
            cross, rest = a[np.ix_(free, own)], -g[own] - point.own[r, own]
            solved = np.linalg.solve(inner, np.column_stack([cross.T, rest]))
            matrix = matrix - cross @ solved[:, :-1]
            right = right - cross @ solved[:, -1]
            parts.append((inner, cross, rest))
    matrix = matrix + damping * np.diag(np.maximum(np.diag(matrix), 1e-12))
    shared = np.zeros(len(own))
    shared[free] = np.linalg.solve(matrix, right)
    each = np.zeros((len(point.own), len(own)))
    for r, (inner, cross, rest) in enumerate(parts):
        each[r, own] = np.linalg.solve(inner, rest - cross.T @ shared[free])
    return Point(shared, each)
