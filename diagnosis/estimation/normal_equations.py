"""Normal equations: J'J and J'e of a fit by recordings, and damped steps from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.estimation.innovations import PredictionResult
from diagnosis.estimation.jacobian import Jacobian
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, bounds_of, per_recording_mask

Sums = tuple[Reals, Reals]
"""J'J (n, n) and J'e (n,)."""


@dataclass(frozen=True)
class NormalEquations:
    """Weighted normal equations: `a` (recordings, n, n) = J'WJ and `g` (recordings, n) = J'We.

    Priors are not included. `own` (n,) marks coordinates per recording.
    """

    a: Reals
    g: Reals
    own: NDArray[np.bool_]

    @cached_property
    def total(self) -> Sums:
        """The sums of `a` (n, n) and `g` (n,) over all recordings."""
        return self.a.sum(axis=0), self.g.sum(axis=0)

    @cached_property
    def by_recording(self) -> dict[int, Sums]:
        """`a` and `g` of each recording by its index; empty without coordinates per recording."""
        return dict(enumerate(zip(self.a, self.g, strict=True))) if self.own.any() else {}


def normal_equations_of(
    candidate: Candidate, prediction: PredictionResult, jacobian: Jacobian
) -> NormalEquations:
    """Return the normal equations of a prediction for all coordinates of a candidate.

    The weights are the inverse mean squares of outputs, divided by |e| / limit beyond the Huber
    limit. Unknown innovations have the weight 0. `jacobian` must have every coordinate of the
    candidate.
    """
    innovation = prediction.stacked
    known = np.isfinite(innovation)
    far = np.maximum(np.abs(innovation) / prediction.huber_limits, 1.0)
    weight = np.where(known, 1.0 / prediction.variances / far, 0.0)
    root = np.sqrt(weight)
    errors = np.where(known, innovation * root, 0.0).reshape(-1)
    count, seen = len(candidate.names), innovation.shape[1]
    changes = np.empty((count, innovation.size))
    for name, row in zip(candidate.names, changes, strict=True):
        np.multiply(jacobian[name], root, out=row.reshape(innovation.shape))
    recordings = len(prediction.slices)
    a, g = np.zeros((recordings, count, count)), np.zeros((recordings, count))
    for place, rows in enumerate(prediction.slices):
        part = slice(seen * rows.start, seen * rows.stop)
        a[place] = changes[:, part] @ changes[:, part].T
        g[place] = changes[:, part] @ errors[part]
    return NormalEquations(a, g, per_recording_mask(candidate))


def damped_step(
    candidate: Candidate,
    point: ParameterVector,
    normal: NormalEquations,
    damping: float,
    per_recording_only: bool = False,
) -> ParameterVector:
    """Return the point after one Levenberg-Marquardt step, clipped to the bounds.

    A shared coordinate at its bound that the step would push further is fixed, and the step is
    solved again (active set). With `per_recording_only` all shared coordinates are fixed.
    """
    bounds = bounds_of(candidate)
    held = np.full(len(point.shared), per_recording_only)
    step = _solve_step(point, normal, damping, held)
    for _ in held:
        trial = point.shared + step.shared
        out = (trial <= bounds[:, 0]) & (point.shared <= bounds[:, 0])
        out |= (trial >= bounds[:, 1]) & (point.shared >= bounds[:, 1])
        out &= ~normal.own & ~held
        if not np.any(out):
            break
        held |= out
        step = _solve_step(point, normal, damping, held)
    shared = np.clip(point.shared + step.shared, bounds[:, 0], bounds[:, 1])
    own = np.clip(point.per_recording + step.per_recording, bounds[:, 0], bounds[:, 1])
    return ParameterVector(shared, own)


def predicted_gain(
    candidate: Candidate, start: ParameterVector, normal: NormalEquations, end: ParameterVector
) -> float:
    """Return the decrease of the cost [nats] from `start` to `end` by the quadratic model.

    The decrease of the prior cost is included; the result is negative if the cost increases.
    """
    step = np.where(normal.own, end.per_recording - start.per_recording, end.shared - start.shared)
    slope = normal.g + 0.5 * (normal.a @ step[:, :, None])[:, :, 0]
    return start.prior_cost(candidate) - end.prior_cost(candidate) - float(np.sum(slope * step))


def _solve_step(
    point: ParameterVector, normal: NormalEquations, damping: float, is_fixed: NDArray[np.bool_]
) -> ParameterVector:
    """Return the damped step; coordinates per recording are eliminated by Schur complements.

    The shared coordinates in `is_fixed` do not move. The damping scales the diagonal (Marquardt
    1963).
    """
    own, free = np.flatnonzero(normal.own), np.flatnonzero(~normal.own & ~is_fixed)
    among = free[:, None], free
    matrix = np.eye(len(free)) + normal.total[0][among]
    right = -point.shared[free] - normal.total[1][free]
    eliminated: dict[int, tuple[Reals, Reals, Reals]] = {}
    for r, (a, g) in normal.by_recording.items():
        inner = a[own[:, None], own]
        inner = inner + np.eye(len(inner)) + damping * np.diag(inner.diagonal())
        cross, rest = a[free[:, None], own], -g[own] - point.per_recording[r, own]
        solved = solve(inner, np.column_stack([cross.T, rest]))
        matrix = matrix - cross @ solved[:, :-1]
        right = right - cross @ solved[:, -1]
        eliminated[r] = (inner, cross, rest)
    matrix = matrix + damping * np.diag(np.maximum(matrix.diagonal(), 1e-12))
    shared = np.zeros(normal.own.shape)
    shared[free] = solve(matrix, right)
    each = np.zeros((len(point.per_recording), len(shared)))
    for r, (inner, cross, rest) in eliminated.items():
        each[r, own] = solve(inner, rest - cross.T @ shared[free])
    return ParameterVector(shared, each)


def solve(matrix: Reals, right: Reals) -> Reals:
    """Return the solution of a linear system, of least norm if the matrix is exactly singular.

    The singular case is a least-squares solution. `right` may have several columns.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        found, *_ = np.linalg.lstsq(matrix, right, rcond=None)
        return np.asarray(found, dtype=np.float64)
