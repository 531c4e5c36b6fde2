"""Normal: the normal equations of a fit, block by block of its recordings, and their solution."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.innovations import PredictionResult
from diagnosis.estimation.jacobian import Jacobian
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, bounds_of, per_recording_mask

Reals = NDArray[np.float64]
Sums = tuple[Reals, Reals]
"""J'J (n, n) and J'e (n,) of some blocks."""


@dataclass(frozen=True)
class NormalEquations:
    """`a` (blocks, n, n) and `g` (blocks, n): J'J and J'e over the mean squares, without priors.

    `own` (n,) tells which coordinates each recording has of its own; `of` (blocks,) is the
    recording of a block, `fold` (blocks,) what it is left out with.
    """

    a: Reals
    g: Reals
    own: NDArray[np.bool_]
    of: NDArray[np.int64]
    fold: NDArray[np.int64]

    def without_fold(self, fold: int) -> NormalEquations:
        """Return the equations of the other folds."""
        kept = self.fold != fold
        return NormalEquations(self.a[kept], self.g[kept], self.own, self.of[kept], self.fold[kept])

    @cached_property
    def total(self) -> Sums:
        """The sums over all blocks."""
        return self.a.sum(axis=0), self.g.sum(axis=0)

    @cached_property
    def by_recording(self) -> dict[int, Sums]:
        """The sums over the blocks of each recording; none without coordinates of its own."""
        if not self.own.any():
            return {}
        here = {int(r): self.of == r for r in np.unique(self.of)}
        return {r: (self.a[of].sum(axis=0), self.g[of].sum(axis=0)) for r, of in here.items()}


def normal_equations_of(
    candidate: Candidate, prediction: PredictionResult, jacobian: Jacobian
) -> NormalEquations:
    """Return the normal equations of an outcome, of all coordinates of a candidate."""
    blocks, innovation = prediction.blocks, prediction.stacked
    known = np.isfinite(innovation)
    far = np.maximum(np.abs(innovation) / prediction.huber_limits, 1.0)
    weight = np.where(known, 1.0 / prediction.variances / far, 0.0)
    root = np.sqrt(weight)
    errors = np.where(known, innovation * root, 0.0).reshape(-1)
    count, seen = len(candidate.names), innovation.shape[1]
    changes = np.empty((count, innovation.size))
    for name, row in zip(candidate.names, changes, strict=True):
        np.multiply(jacobian[name], root, out=row.reshape(innovation.shape))
    a = np.zeros((len(blocks), count, count))
    g = np.zeros((len(blocks), count))
    for place, block in enumerate(blocks):
        part = slice(seen * block.part.start, seen * block.part.stop)
        a[place] = changes[:, part] @ changes[:, part].T
        g[place] = changes[:, part] @ errors[part]
    of, fold = [np.array([getattr(b, name) for b in blocks]) for name in ("recording", "fold")]
    return NormalEquations(a, g, per_recording_mask(candidate), of, fold)


def damped_step(
    candidate: Candidate,
    point: ParameterVector,
    normal: NormalEquations,
    damping: float,
    own_only: bool = False,
) -> ParameterVector:
    """Return the point one damped step further, within the ranges.

    A coordinate at its bound that the step would lead out of its range is held (active set).
    `normal` may lack all blocks of a recording: its own coordinates stay.
    """
    bounds = bounds_of(candidate)
    held = np.full(len(point.shared), own_only)
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
    """Return what the normal equations say that a step gains [nats], priors counted."""
    step = np.where(
        normal.own, (end.per_recording - start.per_recording)[normal.of], end.shared - start.shared
    )
    slope = normal.g + 0.5 * (normal.a @ step[:, :, None])[:, :, 0]
    return start.prior_cost(candidate) - end.prior_cost(candidate) - float(np.sum(slope * step))


def _solve_step(
    point: ParameterVector, normal: NormalEquations, damping: float, is_fixed: NDArray[np.bool_]
) -> ParameterVector:
    """Solve for a step: coordinates of one recording are eliminated before the shared ones."""
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
    """Solve; the smallest solution where changes without bound drown the priors."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        found, *_ = np.linalg.lstsq(matrix, right, rcond=None)
        return np.asarray(found, dtype=np.float64)
