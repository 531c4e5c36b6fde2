"""Jacobian: derivatives of the innovations with respect to coordinates,
by differences or updates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.estimation.innovations import Innovations, PredictionResult
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, per_recording_mask

Jacobian = Mapping[str, Reals]
"""The derivative of the stacked innovations (n, outputs) with respect to each named coordinate."""
MAX_CHANGE = 1e100
"""Bound of a derivative: a diverging run only gives its sign, so the coordinate does not move."""
InnovationsFunction = Callable[[Sequence[ParameterVector]], Sequence[Innovations]]
"""A function from points to their innovations."""
STEP, MIN_STEP = 2e-3, 1e-7
"""Initial and smallest step of a forward difference, in prior standard deviations."""
LINEAR_RANGE = 0.05
"""Change of innovations, in their standard deviations, up to which a difference counts as linear.

The phase of a driveline order changes quickly with its parameter.
"""
MIN_AGREEMENT = 0.5
"""Correlation from which the derivative over the
wide step is preferred to that over the narrow one.
"""
MIN_SQUARED_STEP = 1e-12
"""Squared length below which a step does not update the Jacobian, because of rounding."""


def difference_jacobian(
    candidate: Candidate,
    point: ParameterVector,
    prediction: PredictionResult,
    run: InnovationsFunction,
    names: Iterable[str],
) -> Jacobian:
    """Return the derivatives of the innovations with respect to the named coordinates.

    They are forward differences with the step `STEP` (2e-3). A coordinate whose innovations change
    by more than `LINEAR_RANGE` (0.05 standard deviations, root mean square) is repeated with
    narrower steps down to `MIN_STEP`; the wide difference is kept if it correlates with the last
    narrow one by at least `MIN_AGREEMENT`. Derivatives are clipped to `MAX_CHANGE`, and 0 where
    they are not finite. `run` evaluates all points of one width together.
    """
    scale = np.sqrt(prediction.variances)

    def differences(steps: Mapping[int, float]) -> dict[int, tuple[Reals, float]]:
        """Return the derivative and the rms change (in standard deviations) for each step."""
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
    """Return whether a difference was finite but too large, and its step can be narrowed."""
    return LINEAR_RANGE < change < np.inf and step > MIN_STEP


def _narrow_step(step: float, change: float) -> float:
    """Return the step whose change is half of `LINEAR_RANGE` by proportion, at least `MIN_STEP`."""
    return max(step * LINEAR_RANGE / change / 2.0, MIN_STEP)


def _agrees(first: Reals, second: Reals) -> bool:
    """Return whether two derivatives correlate by at least `MIN_AGREEMENT`.

    Differences over a wide step average over stick-slip transitions.
    """
    both = np.linalg.norm(first) * np.linalg.norm(second)
    return bool(np.sum(first * second) >= MIN_AGREEMENT * both)


def _rms_change(changes: Reals) -> float:
    """Return the root mean square of the known changes;
    infinite without any or beyond `MAX_CHANGE`.
    """
    is_known = ~np.isnan(changes)
    known = changes.ravel() if is_known.all() else changes[is_known]
    if known.size == 0 or max(known.max(), -known.min()) > MAX_CHANGE:
        return np.inf
    return float(np.sqrt(np.mean(known**2)))


def _bounded_changes(changes: Reals) -> Reals:
    """Return changes clipped to `MAX_CHANGE`, with 0 where they are not finite."""
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
    """Return the Jacobian at the end of a step from the one at its start (Broyden 1965, eq. 4.5).

    It is the rank-one update of least norm that reproduces the change of the innovations. With
    coordinates per recording each recording is updated by itself. `step` is the change of each
    coordinate; a step with a squared length below `MIN_SQUARED_STEP` changes nothing. `jacobian`
    itself is not changed.
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
