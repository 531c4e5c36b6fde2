"""Adaptation: what each recording has of its own - a phase, a grade - found with all else held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.estimate import Estimate, innovations_at, looked_at, seen_at, with_normal
from diagnosis.estimation import FIRST_DAMPING, improved
from diagnosis.point import Point
from diagnosis.series import Series

ROUNDS = 5
"""Most steps of what other recordings have of their own."""


def adapted(model: Estimate, series: Sequence[Series]) -> Estimate:
    """Return a model for other recordings, with the gains that it has.

    What all recordings share stays where it is; only what each has of its own is fitted, from the
    best of its starts.
    """
    shared = model.point.shared
    now = seen_at(model, series, Point(shared, np.tile(shared, (len(series), 1))))
    if not any(one.per_recording for one in model.candidate.uncertain):
        return now
    now = min(now, seen_at(model, series, turned(now, series).point), key=lambda one: one.cost)
    damping = FIRST_DAMPING
    still = np.zeros(now.outcome.joined.shape)
    held = {one.name: still for one in model.candidate.uncertain if not one.per_recording}
    for _ in range(ROUNDS if np.isfinite(now.cost) else 0):
        better, damping = improved(with_normal(now, series, held), series, damping, own_only=True)
        if better is None:
            break
        now = better
    return now


def turned(estimate: Estimate, series: Sequence[Series]) -> Estimate:
    """Return an estimate with what each recording has of its own where it is, or at a better start.

    A phase that was turned while others were unknown may have come to rest at a wrong one.
    """
    uncertain = estimate.candidate.uncertain
    own = [k for k, one in enumerate(uncertain) if one.per_recording and len(one.starts) > 1]
    if not own or not np.isfinite(estimate.cost):
        return estimate
    variances = estimate.outcome.variances
    best = estimate.point.own.copy()
    lowest = np.sum(estimate.outcome.runs.squares / variances, axis=1)
    for k in own:
        trials = [best.copy() for _ in uncertain[k].starts]
        for trial, start in zip(trials, uncertain[k].starts, strict=True):
            trial[:, k] = uncertain[k].coordinate(start)
        trials = [trial for trial in trials if not np.array_equal(trial, best)]
        points = [Point(estimate.point.shared, trial) for trial in trials]
        for trial, there in zip(trials, innovations_at(estimate, series, points), strict=True):
            each = np.sum(there.squares / variances, axis=1)
            better = each < lowest
            best[better, k], lowest[better] = trial[better, k], each[better]
    point = Point(estimate.point.shared, best)
    return looked_at(estimate.candidate, series, estimate.noises, point, estimate.outcome)
