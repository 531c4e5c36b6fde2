"""Slopes: how innovations change with the coordinates of a fit - looked for, or carried along."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidate import Candidate
from diagnosis.point import Point, is_own
from diagnosis.prediction import Innovations, Outcome

Reals = NDArray[np.float64]
Columns = Mapping[str, Reals]
"""How the joined innovations (n, seen) of all recordings change with the coordinate of a name."""
MOST = 1e100
"""Bound of a change: a run that leaves all bounds tells no more than its sign, and its coordinate
stays where it is."""
Run = Callable[[Sequence[Point]], Sequence[Innovations]]
"""What is not foreseen at some points."""
STEP, LEAST_STEP = 2e-3, 1e-7
"""Change of a coordinate for a difference, in standard deviations of its prior."""
FAR = 0.05
"""Change of innovations, in their standard deviations, up to which they follow a coordinate in
proportion: the phase of a tone runs far with its order."""
ALIKE = 0.5
"""Correlation of changes from which on those over the wider step are taken."""
SHORTEST = 1e-12
"""Square of a step from which on slopes are carried along it: rounding tells nothing."""


def columns_of(
    candidate: Candidate,
    point: Point,
    outcome: Outcome,
    run: Run,
    names: Iterable[str],
) -> Columns:
    """Return how innovations change with some coordinates, by forward differences of `run`.

    Those over the wide step are run together, then the narrower ones of coordinates that need them.
    """
    scale = np.sqrt(outcome.variances)

    def differences(steps: Mapping[int, float]) -> dict[int, tuple[Reals, float]]:
        ahead = [point.moved(candidate, k, step) for k, step in steps.items()]
        sizes = [float(p.shared[k] - point.shared[k]) for k, p in zip(steps, ahead, strict=True)]
        changes = (there.joined - outcome.joined for there in run(ahead))
        return {
            k: (_known(change / size), _far(change / scale))
            for k, size, change in zip(steps, sizes, changes, strict=True)
        }

    steps = {candidate.names.index(name): STEP for name in names}
    wide = differences(steps)
    narrow = dict(wide)
    while steps := {
        k: _narrower(step, narrow[k][1])
        for k, step in steps.items()
        if _is_too_far(step, narrow[k][1])
    }:
        narrow |= differences(steps)
    return {
        candidate.names[k]: there if _is_alike(there, narrow[k][0]) else narrow[k][0]
        for k, (there, _) in wide.items()
    }


def _is_too_far(step: float, far: float) -> bool:
    return FAR < far < np.inf and step > LEAST_STEP


def _narrower(step: float, far: float) -> float:
    return max(step * FAR / far / 2.0, LEAST_STEP)


def _is_alike(first: Reals, second: Reals) -> bool:
    """Tell whether changes over a wide step are those over a narrow one: they even out what sticks
    and slips.
    """
    both = np.linalg.norm(first) * np.linalg.norm(second)
    return bool(np.sum(first * second) >= ALIKE * both)


def _far(changes: Reals) -> float:
    """Return the root mean square of what is known of changes; without bound where one is."""
    is_known = ~np.isnan(changes)
    known = changes.ravel() if is_known.all() else changes[is_known]
    if known.size == 0 or max(known.max(), -known.min()) > MOST:
        return np.inf
    return float(np.sqrt(np.mean(known**2)))


def _known(changes: Reals) -> Reals:
    """Return changes, 0 where there is none: nothing was seen, or the run left all bounds."""
    is_known = np.isfinite(changes)
    known = changes if is_known.all() else np.where(is_known, changes, 0.0)
    return np.clip(known, -MOST, MOST)


def carried(
    candidate: Candidate, columns: Columns, before: Outcome, after: Outcome, step: Point
) -> Columns:
    """Return slopes at the end of a step from those at its beginning (Broyden 1965, equation 4.5).

    They change as little as shows what the innovations of each recording did. `step` is how far
    each coordinate went.
    """
    own, names = is_own(candidate), candidate.names
    found = {name: columns[name].copy() for name in names}
    changes = after.joined - before.joined
    for r, part in enumerate(before.parts if np.any(own) else [slice(None)]):
        moved = np.where(own, step.own[r], step.shared)
        length = float(moved @ moved)
        if length < SHORTEST:
            continue
        left = changes[part] - sum(
            moved[k] * found[name][part] for k, name in enumerate(names) if moved[k] != 0.0
        )
        left = np.where(np.isfinite(left), left, 0.0) / length
        for k, name in enumerate(names):
            if moved[k] != 0.0:
                found[name][part] += moved[k] * left
    return found
