"""Estimation: the parameters of a candidate by prediction errors, with priors, within their ranges.

Levenberg-Marquardt on the concentrated likelihood: N/2 log(mean square innovation) per channel
plus half the squares of the coordinates. The gains are held while a step is sought, and made anew
from the model at its end.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.gains import gains_of
from diagnosis.likeness import seen_like
from diagnosis.normal import Normal, foreseen, normal_of, stepped
from diagnosis.point import Point, all_values_at, point_of, values_at
from diagnosis.prediction import (
    Gains,
    Innovations,
    Noises,
    Outcome,
    foreseen_at,
    noises_at,
    predicted,
)
from diagnosis.series import Series
from diagnosis.slopes import Columns, carried, columns_of

MOST_ROUNDS = 15
ENOUGH = 0.3
"""A round that gains less than this [nats] is the last."""
ENOUGH_CARRIED = 2.0
"""The same where slopes were carried along steps from where they were looked for."""
WORTH_ANEW = 1.0
"""Steps that gain more [nats] once slopes were looked for anew have them looked for again."""
COMPLETIONS = 12
"""How often they are at most: a tyre's mode had not come to rest after three."""
LEVEL_STEP = 0.05
"""Change of the logarithm of a level for a difference."""
NOTHING = 0.05
"""A step that is foreseen to gain less than this [nats] is not tried."""
LITTLE = 1.0
"""The same while candidates are screened."""
FIRST_DAMPING = 1e-3
LARGEST_DAMPING = 1e5
SCREENED_ROUNDS, ROUNDS_OF_ONE = 8, 4
"""Most rounds while candidates are screened, and those after which, on a single recording, which
cannot tell chance from physics, a further one has to gain much."""
LATE_PART = 0.1
"""What is much: part of all that was gained."""
WORTH_A_ROUND = 3.0
"""A round of screening that gains less [nats] is the last."""


@dataclass(frozen=True)
class Estimate:
    """A candidate at a point: cost [nats] with priors, and how it foresees the recordings.

    `normal` are the normal equations of the last round, None before the first, and `columns` what
    they were made from.
    """

    candidate: Candidate
    point: Point
    cost: float
    outcome: Outcome = field(repr=False)
    gains: Gains = field(repr=False)
    noises: Noises = field(repr=False)
    normal: Normal | None = field(default=None, repr=False)
    columns: Columns = field(default_factory=dict, repr=False)

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
    outcome = _run(candidate, series, point, gains, noises)
    if near is None and outcome.is_whole:
        gains = gains_of(candidate, series, values, noises, outcome)
        outcome = _run(candidate, series, point, gains, noises)
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
    own = _run(candidate, series, point, gains, noises)
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
    for name in names:
        k = candidate.names.index(name)
        there = now.point.moved(candidate, k, LEVEL_STEP / candidate.uncertain[k].sd)
        outcome = _run(candidate, series, now.point, _gains(now, series, there), now.noises)
        changes = (outcome.joined - now.outcome.joined) / (there.shared[k] - now.point.shared[k])
        found[name] = np.where(np.isfinite(changes), changes, 0.0)
    return found


def _gains(now: Estimate, series: Sequence[Series], point: Point) -> Gains:
    """Return the gains of an estimate with the levels that its candidate has at a point."""
    if not now.candidate.levels:
        return now.gains
    noises, values = noises_at(now.candidate, point, now.noises), now.values(0)
    return gains_of(now.candidate, series, values, noises, now.outcome)


def estimated(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    start: Mapping[str, float] | Point,
    rounds: int = MOST_ROUNDS,
    known: Columns | None = None,
) -> Estimate:
    """Return the point that foresees the recordings best, from `start` [SI].

    `known` are slopes of the candidate near the start, if there are such.
    """
    return completed(followed(candidate, series, noises, start, rounds, known), series, rounds)


def followed(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    start: Mapping[str, float] | Point,
    rounds: int = MOST_ROUNDS,
    known: Columns | None = None,
    like: Estimate | None = None,
) -> Estimate:
    """Return where steps lead with slopes that are looked for once, and carried along them.

    A model `like` it may tell where the modes are at the start.
    """
    point = start if isinstance(start, Point) else point_of(candidate, len(series), start)
    now = looked_like(candidate, series, noises, point, like)
    return _walked(with_normal(now, series, known), series, rounds) if _is_known(now) else now


def completed(now: Estimate, series: Sequence[Series], rounds: int = MOST_ROUNDS) -> Estimate:
    """Return a fit that is done: slopes are looked for at its end, and steps sought with these."""
    if not _is_known(now):
        return now
    for _ in range(COMPLETIONS):
        now = with_normal(now, series)
        further = _walked(now, series, rounds, least=ENOUGH)
        if now.cost - further.cost < WORTH_ANEW:
            return further
        now = further
    return with_normal(now, series)


def _is_known(now: Estimate) -> bool:
    return bool(np.isfinite(now.cost))


def _walked(
    now: Estimate, series: Sequence[Series], rounds: int, least: float = ENOUGH_CARRIED
) -> Estimate:
    """Return where steps lead until one gains less than the `least` [nats]."""
    damping = FIRST_DAMPING
    for _ in range(rounds):
        better, damping = improved(now, series, damping)
        if better is None:
            return now
        gained = now.cost - better.cost
        renewed = looked_at(now.candidate, series, better.noises, better.point, better.outcome)
        best = renewed if renewed.cost < better.cost + ENOUGH else better
        now = _moved(now, better, best, series)
        if gained < least:
            return now
    return now


def _moved(
    before: Estimate, after: Estimate, there: Estimate, series: Sequence[Series]
) -> Estimate:
    """Return an estimate `there` with the slopes of the one `before`, carried along the step after
    which it is. The gains there may be others than those of the step.
    """
    first, last = before.point, after.point
    step = Point(last.shared - first.shared, last.own - first.own)
    columns = carried(before.candidate, before.columns, before.outcome, after.outcome, step)
    return with_normal(there, series, columns)


def reached(estimate: Estimate, series: Sequence[Series], known: Columns, rounds: int) -> Estimate:
    """Return where some steps lead for which `known` columns of a model near it are good enough.

    Slopes of what the other model has not are looked for at each step: carried ones did not find
    unequal shafts, which begin far from where they fit.
    """
    if not _is_known(estimate):
        return estimate
    now, damping = estimate, FIRST_DAMPING
    early = ROUNDS_OF_ONE if len(series) == 1 else SCREENED_ROUNDS
    for done in range(1, rounds + 1):
        better, damping = improved(with_normal(now, series, known), series, damping, least=LITTLE)
        if better is None:
            break
        gained, now = now.cost - better.cost, better
        late = LATE_PART * (estimate.cost - now.cost) if done >= early else 0.0
        if gained < max(WORTH_A_ROUND, late):
            break
    return now


def regained(now: Estimate, series: Sequence[Series]) -> Estimate:
    """Return an estimate with gains made where it is, if they are better than those it has."""
    again = looked_at(now.candidate, series, now.noises, now.point, now.outcome)
    return min(now, again, key=lambda one: one.cost)


def improved(
    now: Estimate,
    series: Sequence[Series],
    damping: float,
    own_only: bool = False,
    least: float = NOTHING,
) -> tuple[Estimate | None, float]:
    """Return a better point and the damping that led there; None where there is none.

    A step that is foreseen to gain less than the `least` [nats] is not tried.
    """
    assert now.normal is not None
    while damping < LARGEST_DAMPING:
        point = stepped(now.candidate, now.point, now.normal, damping, own_only)
        if foreseen(now.candidate, now.point, now.normal, point) < least:
            damping *= 10.0
            continue
        gains = _gains(now, series, point)
        outcome = _run(now.candidate, series, point, gains, now.noises)
        cost = outcome.cost() + point.prior(now.candidate)
        if cost < now.cost:
            noises = noises_at(now.candidate, point, now.noises)
            better = Estimate(now.candidate, point, cost, outcome, gains, noises)
            better = dataclasses.replace(better, normal=now.normal, columns=now.columns)
            return better, max(damping / 10.0, 1e-9)
        damping *= 10.0
    return None, damping


def _run(
    candidate: Candidate, series: Sequence[Series], point: Point, gains: Gains, noises: Noises
) -> Outcome:
    values = all_values_at(candidate, point)[: len(series)]
    return predicted(candidate, series, values, gains, noises.limits)


def outcome_at(estimate: Estimate, series: Sequence[Series], point: Point) -> Outcome:
    """Return how a model foresees some recordings at a point, with the gains of the estimate."""
    return _run(estimate.candidate, series, point, estimate.gains, estimate.noises)


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
    return dataclasses.replace(
        estimate, point=point, cost=cost, outcome=outcome, normal=None, columns={}
    )
