"""Normal: the normal equations of a fit, block by block of its recordings, and their solution."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidate import Candidate
from diagnosis.point import Point, bounds_of, is_own
from diagnosis.prediction import Outcome

Reals = NDArray[np.float64]
Columns = Mapping[str, Reals]
"""How the joined innovations (n, seen) of all recordings change with the coordinate of a name."""
MOST = 1e100
"""Bound of a change: a run that leaves all bounds tells no more than its sign, and its coordinate
stays where it is."""
STEP, LEAST_STEP = 2e-3, 1e-7
"""Change of a coordinate for a difference, in standard deviations of its prior."""
FAR = 0.05
"""Change of innovations, in their standard deviations, up to which they follow a coordinate in
proportion: the phase of a tone runs far with its order."""
ALIKE = 0.5
"""Correlation of changes from which on those over the wider step are taken."""


@dataclass(frozen=True)
class Normal:
    """`a` (blocks, n, n) and `g` (blocks, n): J'J and J'e over the mean squares, without priors.

    `own` (n,) tells which coordinates each recording has of its own; `of` (blocks,) is the
    recording of a block, `fold` (blocks,) what it is left out with.
    """

    a: Reals
    g: Reals
    own: NDArray[np.bool_]
    of: NDArray[np.int64]
    fold: NDArray[np.int64]

    def without(self, fold: int) -> Normal:
        """Return the equations of the other folds."""
        kept = self.fold != fold
        return Normal(self.a[kept], self.g[kept], self.own, self.of[kept], self.fold[kept])


def columns_of(
    candidate: Candidate,
    point: Point,
    outcome: Outcome,
    run: Callable[[Point], Outcome],
    names: Iterable[str],
) -> Columns:
    """Return how innovations change with some coordinates, by forward differences of `run`."""
    scale = np.sqrt(outcome.variances)

    def difference(k: int, step: float) -> tuple[Reals, float]:
        ahead = point.moved(candidate, k, step)
        size = float(ahead.shared[k] - point.shared[k])
        changes = run(ahead).joined - outcome.joined
        return _known(changes / size), _far(changes / scale)

    def slope(k: int) -> Reals:
        step = STEP
        wide, far = difference(k, step)
        narrow = wide
        while FAR < far < np.inf and step > LEAST_STEP:
            step = max(step * FAR / far / 2.0, LEAST_STEP)
            narrow, far = difference(k, step)
        return wide if _is_alike(wide, narrow) else narrow

    return {name: slope(candidate.names.index(name)) for name in names}


def _is_alike(first: Reals, second: Reals) -> bool:
    """Tell whether changes over a wide step are those over a narrow one: they even out what sticks
    and slips.
    """
    both = np.linalg.norm(first) * np.linalg.norm(second)
    return bool(np.sum(first * second) >= ALIKE * both)


def _far(changes: Reals) -> float:
    """Return the root mean square of what is known of changes; without bound where one is."""
    known = changes[~np.isnan(changes)]
    if known.size == 0 or np.max(np.abs(known)) > MOST:
        return np.inf
    return float(np.sqrt(np.mean(known**2)))


def _known(changes: Reals) -> Reals:
    """Return changes, 0 where there is none: nothing was seen, or the run left all bounds."""
    return np.clip(np.where(np.isfinite(changes), changes, 0.0), -MOST, MOST)


def normal_of(candidate: Candidate, outcome: Outcome, columns: Columns) -> Normal:
    """Return the normal equations of an outcome, of all coordinates of a candidate."""
    blocks, innovation = outcome.blocks, outcome.joined
    known = np.isfinite(innovation)
    far = np.maximum(np.abs(innovation) / outcome.limits, 1.0)
    weight = np.where(known, 1.0 / outcome.variances / far, 0.0)
    missed = np.where(known, innovation, 0.0)
    jacobian = np.array([columns[name] for name in candidate.names])
    count = len(jacobian)
    jacobian = jacobian.reshape(count, *innovation.shape)
    a = np.zeros((len(blocks), count, count))
    g = np.zeros((len(blocks), count))
    for place, block in enumerate(blocks):
        error = missed[block.part].reshape(-1)
        changes = jacobian[:, block.part].reshape(count, len(error))
        weighted = changes * weight[block.part].reshape(-1)
        a[place] = weighted @ changes.T
        g[place] = weighted @ error
    of, fold = [np.array([getattr(b, name) for b in blocks]) for name in ("recording", "fold")]
    return Normal(a, g, is_own(candidate), of, fold)


def stepped(
    candidate: Candidate,
    point: Point,
    normal: Normal,
    damping: float,
    own_only: bool = False,
) -> Point:
    """Return the point one damped step further, within the ranges.

    A coordinate at its bound that the step would lead out of its range is held (active set).
    `normal` may lack all blocks of a recording: its own coordinates stay.
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


def _solved(point: Point, normal: Normal, damping: float, held: NDArray[np.bool_]) -> Point:
    """Solve for a step: coordinates of one recording are eliminated before the shared ones."""
    own, free = normal.own, ~normal.own & ~held
    matrix = np.eye(int(free.sum())) + normal.a.sum(axis=0)[np.ix_(free, free)]
    right = -point.shared[free] - normal.g.sum(axis=0)[free]
    parts: dict[int, tuple[Reals, Reals, Reals]] = {}
    for r in np.unique(normal.of) if np.any(own) else ():
        a, g = normal.a[normal.of == r].sum(axis=0), normal.g[normal.of == r].sum(axis=0)
        inner = a[np.ix_(own, own)]
        inner = inner + np.eye(len(inner)) + damping * np.diag(np.diag(inner))
        cross, rest = a[np.ix_(free, own)], -g[own] - point.own[r, own]
        solved = solution(inner, np.column_stack([cross.T, rest]))
        matrix = matrix - cross @ solved[:, :-1]
        right = right - cross @ solved[:, -1]
        parts[int(r)] = (inner, cross, rest)
    matrix = matrix + damping * np.diag(np.maximum(np.diag(matrix), 1e-12))
    shared = np.zeros(len(own))
    shared[free] = solution(matrix, right)
    each = np.zeros((len(point.own), len(own)))
    for r, (inner, cross, rest) in parts.items():
        each[r, own] = solution(inner, rest - cross.T @ shared[free])
    return Point(shared, each)


def solution(matrix: Reals, right: Reals) -> Reals:
    """Solve; the smallest solution where changes without bound drown the priors."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        found, *_ = np.linalg.lstsq(matrix, right, rcond=None)
        return np.asarray(found, dtype=np.float64)
