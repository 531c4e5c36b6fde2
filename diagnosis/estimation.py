"""Estimation: the parameters of a candidate by prediction errors, with priors, within their ranges.

Levenberg-Marquardt on the concentrated likelihood: N/2 log(mean square innovation) per channel
plus half the squares of the coordinates. The gains are held while a step is sought, and made anew
from the model at its end.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.candidate import Candidate
from diagnosis.estimate import (
    Estimate,
    gains_there,
    looked_at,
    looked_like,
    run_at,
    with_normal,
)
from diagnosis.normal import foreseen, stepped
from diagnosis.point import Point, point_of
from diagnosis.prediction import Noises, noises_at
from diagnosis.series import Series
from diagnosis.slopes import Columns, carried

MOST_ROUNDS = 15
ENOUGH = 0.3
"""A round that gains less than this [nats] is the last."""
ENOUGH_CARRIED = 2.0
"""The same where slopes were carried along steps from where they were looked for."""
WORTH_ANEW = 1.0
"""Steps that gain more [nats] once slopes were looked for anew have them looked for again."""
COMPLETIONS = 12
"""How often they are at most: a tyre's mode had not come to rest after three."""
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
    return completed(led(candidate, series, noises, start, rounds, known), series, rounds)


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
    return _walked_from(candidate, series, noises, start, rounds, known, like).ended(series)


def led(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    start: Mapping[str, float] | Point,
    rounds: int = MOST_ROUNDS,
    known: Columns | None = None,
    like: Estimate | None = None,
) -> Estimate:
    """Return what `followed` does, without slopes at its end: those are looked for anew."""
    return _walked_from(candidate, series, noises, start, rounds, known, like).there


def _walked_from(
    candidate: Candidate,
    series: Sequence[Series],
    noises: Noises,
    start: Mapping[str, float] | Point,
    rounds: int,
    known: Columns | None,
    like: Estimate | None,
) -> _Walk:
    point = start if isinstance(start, Point) else point_of(candidate, len(series), start)
    now = looked_like(candidate, series, noises, point, like)
    if not _is_known(now):
        return _Walk(now)
    return _walked(with_normal(now, series, known), series, rounds)


def completed(now: Estimate, series: Sequence[Series], rounds: int = MOST_ROUNDS) -> Estimate:
    """Return a fit that is done: slopes are looked for at its end, and steps sought with these."""
    if not _is_known(now):
        return now
    for _ in range(COMPLETIONS):
        now = with_normal(now, series)
        further = _walked(now, series, rounds, least=ENOUGH)
        if now.cost - further.there.cost < WORTH_ANEW:
            return further.ended(series)
        now = further.there
    return with_normal(now, series)


def _is_known(now: Estimate) -> bool:
    return bool(np.isfinite(now.cost))


@dataclass(frozen=True)
class _Walk:
    """Where steps led: `there`, and the ends of the last one, along which slopes are to be carried
    to it; None where it has them.
    """

    there: Estimate
    step: tuple[Estimate, Estimate] | None = None

    def ended(self, series: Sequence[Series]) -> Estimate:
        """Return where the steps led, with its slopes."""
        return _moved(*self.step, self.there, series) if self.step else self.there


def _walked(
    now: Estimate, series: Sequence[Series], rounds: int, least: float = ENOUGH_CARRIED
) -> _Walk:
    """Return where steps lead until one gains less than the `least` [nats]."""
    damping, walk = FIRST_DAMPING, _Walk(now)
    for _ in range(rounds):
        now = walk.ended(series)
        better, damping = improved(now, series, damping)
        if better is None:
            return _Walk(now)
        renewed = looked_at(now.candidate, series, better.noises, better.point, better.outcome)
        best = renewed if renewed.cost < better.cost + ENOUGH else better
        walk = _Walk(best, (now, better))
        if now.cost - better.cost < least:
            break
    return walk


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
    if not _is_known(estimate) or estimate.in_vain is known:
        return estimate
    now, damping = estimate, FIRST_DAMPING
    early = ROUNDS_OF_ONE if len(series) == 1 else SCREENED_ROUNDS
    for done in range(1, rounds + 1):
        least_damping = damping
        better, damping = improved(with_normal(now, series, known), series, damping, least=LITTLE)
        if better is None:
            is_all = least_damping <= FIRST_DAMPING
            return dataclasses.replace(now, in_vain=known) if is_all else now
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
        gains = gains_there(now, series, point)
        outcome = run_at(now.candidate, series, point, gains, now.noises)
        cost = outcome.cost() + point.prior(now.candidate)
        if cost < now.cost:
            noises = noises_at(now.candidate, point, now.noises)
            better = Estimate(now.candidate, point, cost, outcome, gains, noises)
            better = dataclasses.replace(better, normal=now.normal, columns=now.columns)
            return better, max(damping / 10.0, 1e-9)
        damping *= 10.0
    return None, damping
