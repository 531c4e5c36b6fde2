"""Estimate: a candidate at a point, and how it foresees the recordings there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.gains import gains_of
from diagnosis.likeness import seen_like
from diagnosis.normal import Normal, normal_of
from diagnosis.point import Point, all_values_at, values_at
from diagnosis.prediction import (
    Gains,
    Innovations,
    Noises,
    Outcome,
    foreseen_at,
    foreseen_with,
    noises_at,
    predicted,
)
from diagnosis.series import Series
from diagnosis.slopes import Columns, columns_of

LEVEL_STEP = 0.05
"""Change of the logarithm of a level for a difference."""


@dataclass(frozen=True)
class Estimate:
    """A candidate at a point: cost [nats] with priors, and how it foresees the recordings.

    `normal` are the normal equations of the last round, None before the first, and `columns` what
    they were made from. `in_vain` are the columns of a model near it with which steps of screening
    were sought from here, and led nowhere.
    """

    candidate: Candidate
    point: Point
    cost: float
    outcome: Outcome = field(repr=False)
    gains: Gains = field(repr=False)
    noises: Noises = field(repr=False)
    normal: Normal | None = field(default=None, repr=False)
    columns: Columns = field(default_factory=dict, repr=False)
    in_vain: Columns | None = field(default=None, repr=False)

    @property
    def likelihood(self) -> float:
        """The cost without priors [nats]."""
        return self.outcome.cost()

    def values(self, recording: int) -> dict[str, float]:
        """Return the parameters [SI] of a recording."""
        return values_at(self.candidate, self.point, recording)


def looked_at(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    point: Point,
    near: Outcome | None = None,
) -> Estimate:
    """Return a candidate at a point, with gains made where its modes were seen.

    `near` is where they were seen at a point near it, if that is known.
    """
    values = values_at(candidate, point, 0)
    gains = gains_of(candidate, series, values, noises, near)
    outcome = run_at(candidate, series, point, gains, noises)
    if near is None and outcome.is_whole:
        gains = gains_of(candidate, series, values, noises, outcome)
        outcome = run_at(candidate, series, point, gains, noises)
    cost = outcome.cost() + point.prior(candidate)
    return Estimate(candidate, point, cost, outcome, gains, noises)


def looked_like(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    point: Point,
    like: Estimate | None,
) -> Estimate:
    """Return a candidate at a point, with gains made where its modes were seen: where it had them
    itself, or where a model `like` it had them, whichever foresees better.
    """
    if like is None:
        return looked_at(candidate, series, noises, point)
    gains = gains_of(candidate, series, values_at(candidate, point, 0), noises)
    own = run_at(candidate, series, point, gains, noises)
    if not own.is_whole:
        return Estimate(candidate, point, np.inf, own, gains, noises)
    near = seen_like(candidate, own, like.candidate, like.outcome)
    first = looked_at(candidate, series, noises, point, own)
    if near is own:
        return first
    return min(first, looked_at(candidate, series, noises, point, near), key=lambda one: one.cost)


def with_normal(
    estimate: Estimate, series: Sequence[Series], known: Columns | None = None
) -> Estimate:
    """Return an estimate with the normal equations at its point.

    `known` are columns of a model near it, which are not looked for again.
    """

    def run(points: Sequence[Point]) -> list[Innovations]:
        return innovations_at(estimate, series, points)

    candidate, outcome = estimate.candidate, estimate.outcome
    known = known or {}
    fresh = [one.name for one in candidate.recipe.uncertain if one.name not in known]
    columns = {**known, **columns_of(candidate, estimate.point, outcome, run, fresh)}
    columns |= _of_levels(
        estimate, series, [o.name for o in candidate.levels if o.name not in known]
    )
    normal = normal_of(candidate, outcome, columns)
    return dataclasses.replace(estimate, normal=normal, columns=columns)


def _of_levels(now: Estimate, series: Sequence[Series], names: Sequence[str]) -> Columns:
    """Return how innovations change with levels: with the gains that are made with these."""
    candidate, found = now.candidate, {}
    places = [candidate.names.index(name) for name in names]
    moved = [now.point.moved(candidate, k, LEVEL_STEP / candidate.uncertain[k].sd) for k in places]
    gains = [gains_there(now, series, there) for there in moved]
    values = all_values_at(candidate, now.point)[: len(series)]
    runs = foreseen_with(candidate, series, values, gains, now.noises.limits)
    for name, k, there, run in zip(names, places, moved, runs, strict=True):
        changes = (run.joined - now.outcome.joined) / (there.shared[k] - now.point.shared[k])
        found[name] = np.where(np.isfinite(changes), changes, 0.0)
    return found


def gains_there(now: Estimate, series: Sequence[Series], point: Point) -> Gains:
    """Return the gains of an estimate with the levels that its candidate has at a point."""
    if not now.candidate.levels:
        return now.gains
    noises, values = noises_at(now.candidate, point, now.noises), now.values(0)
    return gains_of(now.candidate, series, values, noises, now.outcome)


def run_at(
    candidate: Candidate, series: Sequence[Series], point: Point, gains: Gains, noises: Noises
) -> Outcome:
    """Return how a candidate foresees recordings at a point with some gains."""
    values = all_values_at(candidate, point)[: len(series)]
    return predicted(candidate, series, values, gains, noises.limits)


def outcome_at(estimate: Estimate, series: Sequence[Series], point: Point) -> Outcome:
    """Return how a model foresees some recordings at a point, with the gains of the estimate."""
    return run_at(estimate.candidate, series, point, estimate.gains, estimate.noises)


def innovations_at(
    estimate: Estimate, series: Sequence[Series], points: Sequence[Point]
) -> list[Innovations]:
    """Return what a model does not foresee at some points, with the gains of the estimate."""
    candidate, gains = estimate.candidate, estimate.gains
    values = [all_values_at(candidate, point)[: len(series)] for point in points]
    return foreseen_at(candidate, series, values, gains, estimate.noises.limits) if points else []


def seen_at(estimate: Estimate, series: Sequence[Series], point: Point) -> Estimate:
    """Return an estimate at a point for some recordings, with the gains that it has."""
    outcome = outcome_at(estimate, series, point)
    cost = outcome.cost() + point.prior(estimate.candidate)
    return Estimate(estimate.candidate, point, cost, outcome, estimate.gains, estimate.noises)
