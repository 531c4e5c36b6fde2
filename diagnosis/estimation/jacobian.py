"""Slopes: how innovations change with the coordinates of a fit - looked for, or carried along."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.innovations import Innovations, PredictionResult
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, per_recording_mask

Reals = NDArray[np.float64]
Jacobian = Mapping[str, Reals]
"""How the joined innovations (n, seen) of all recordings change with the coordinate of a name."""
MAX_CHANGE = 1e100
"""Bound of a change: a run that leaves all bounds tells no more than its sign, and its coordinate
stays where it is."""
InnovationsFunction = Callable[[Sequence[ParameterVector]], Sequence[Innovations]]
"""What is not foreseen at some points."""
STEP, MIN_STEP = 2e-3, 1e-7
"""Change of a coordinate for a difference, in standard deviations of its prior."""
LINEAR_RANGE = 0.05
"""Change of innovations, in their standard deviations, up to which they follow a coordinate in
proportion: the phase of a tone runs far with its order."""
MIN_AGREEMENT = 0.5
"""Correlation of changes from which on those over the wider step are taken."""
MIN_SQUARED_STEP = 1e-12
"""Square of a step from which on slopes are carried along it: rounding tells nothing."""


def difference_jacobian(
    candidate: Candidate,
    point: ParameterVector,
    prediction: PredictionResult,
    run: InnovationsFunction,
    names: Iterable[str],
) -> Jacobian:
    """Return how innovations change with some coordinates, by forward differences of `run`.

    Those over the wide step are run together, then the narrower ones of coordinates that need them.
    """
    scale = np.sqrt(prediction.variances)

    def differences(steps: Mapping[int, float]) -> dict[int, tuple[Reals, float]]:
        ahead = [point.perturb(candidate, k, step) for k, step in steps.items()]
        sizes = [float(p.shared[k] - point.shared[k]) for k, p in zip(steps, ahead, strict=True)]
        changes = (there.stacked - prediction.stacked for there in run(ahead))
        return {
            k: (_bounded_changes(change / size), _rms_change(change / scale))
            for k, size, change in zip(steps, sizes, changes, strict=True)
        }

    steps = {candidate.names.index(name): STEP for name in names}
    wide = differences(steps)
    narrow = dict(wide)
    while steps := {
        k: _narrow_step(step, narrow[k][1])
        for k, step in steps.items()
        if _exceeds_linear_range(step, narrow[k][1])
    }:
        narrow |= differences(steps)
    return {
        candidate.names[k]: there if _agrees(there, narrow[k][0]) else narrow[k][0]
        for k, (there, _) in wide.items()
    }


def _exceeds_linear_range(step: float, change: float) -> bool:
    return LINEAR_RANGE < change < np.inf and step > MIN_STEP


def _narrow_step(step: float, change: float) -> float:
    return max(step * LINEAR_RANGE / change / 2.0, MIN_STEP)


def _agrees(first: Reals, second: Reals) -> bool:
    """Tell whether changes over a wide step are those over a narrow one: they even out what sticks
    and slips.
    """
    both = np.linalg.norm(first) * np.linalg.norm(second)
    return bool(np.sum(first * second) >= MIN_AGREEMENT * both)


def _rms_change(changes: Reals) -> float:
    """Return the root mean square of what is known of changes; without bound where one is."""
    is_known = ~np.isnan(changes)
    known = changes.ravel() if is_known.all() else changes[is_known]
    if known.size == 0 or max(known.max(), -known.min()) > MAX_CHANGE:
        return np.inf
    return float(np.sqrt(np.mean(known**2)))


def _bounded_changes(changes: Reals) -> Reals:
    """Return changes, 0 where there is none: nothing was seen, or the run left all bounds."""
    is_known = np.isfinite(changes)
    known = changes if is_known.all() else np.where(is_known, changes, 0.0)
    return np.clip(known, -MAX_CHANGE, MAX_CHANGE)


def broyden_update(
    candidate: Candidate,
    jacobian: Jacobian,
    before: PredictionResult,
    after: PredictionResult,
    step: ParameterVector,
) -> Jacobian:
    """Return slopes at the end of a step from those at its beginning (Broyden 1965, equation 4.5).

    They change as little as shows what the innovations of each recording did. `step` is how far
    each coordinate went.
    """
    own, names = per_recording_mask(candidate), candidate.names
    updated = {name: jacobian[name].copy() for name in names}
    changes = after.stacked - before.stacked
    for r, part in enumerate(before.slices if np.any(own) else [slice(None)]):
        moved = np.where(own, step.per_recording[r], step.shared)
        length = float(moved @ moved)
        if length < MIN_SQUARED_STEP:
            continue
        residual = changes[part] - sum(
            moved[k] * updated[name][part] for k, name in enumerate(names) if moved[k] != 0.0
        )
        residual = np.where(np.isfinite(residual), residual, 0.0) / length
        for k, name in enumerate(names):
            if moved[k] != 0.0:
                updated[name][part] += moved[k] * residual
    return updated
