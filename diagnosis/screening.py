"""Screening: what candidates promise by steps from their starts: on some recordings, then all."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from diagnosis.adaptation import turned
from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_at, looked_like, seen_at
from diagnosis.estimation import SCREENED_ROUNDS, reached, regained
from diagnosis.layers import Layer
from diagnosis.point import Point, extended
from diagnosis.prediction import Outcome
from diagnosis.series import Series

SCREENED_PART, FEWEST_SCREENED, MOST_SCREENED = 1 / 3, 3, 5
"""The part of the recordings that candidates are screened on first, spread over all, and how many
these are at least and at most."""
MOST_ON_ALL = 10
"""Candidates that are then screened on all, those that gained most; and as many again at most that
the others alone may show."""
HINT = 2.0
"""Nats that a candidate gains at least, if it is to be looked at further."""
LOST = 100.0
"""Nats: a start that loses as much on some recordings gains nothing on all."""
STARTS, STARTS_BESIDE = 2, 1
"""Starts of a candidate from which steps are made, the best ones: alone, and beside what was
accepted, where a second one was hardly ever better."""
RACE = 2
"""Steps from each of them; then the better one goes on alone."""
STRONG = 2000.0
"""Nats that one candidate gains after these steps from which on others are held against it."""
BEHIND = 0.02
"""Part of what the best one gains that another has to gain to go on: none was seen to overtake one
so far ahead, and what is weak is looked for again beside what is strong."""
Known = tuple[Layer, Candidate]
Fits = Mapping[str, Mapping[str, float]]
"""What an effect's own parameters were where it was fitted alone, by its layer."""
One = TypeVar("One")


@dataclass(frozen=True)
class Promise:
    """What a candidate gains [nats] some steps from its start, and where it then is: None where it
    was not looked at on all recordings.
    """

    layer: Layer
    gain: float
    start: Estimate | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Part:
    """Some recordings, the `rows` of a bench, as a `bench` of their own, with the `base` there;
    candidates start where they were fitted `alone`, too.
    """

    rows: list[int]
    bench: Bench
    base: Estimate = field(repr=False)
    alone: Fits = field(default_factory=dict, repr=False)

    def point(self, whole: Point) -> Point:
        """Return a point of all recordings for these."""
        return Point(whole.shared, whole.own[self.rows])


def promises(
    bench: Bench, base: Estimate, known: Sequence[Known], least: float, alone: Fits | None = None
) -> list[Promise]:
    """Return what candidates promise, the best first; one that gains `least` [nats] is looked at on
    all recordings, unless many gain more or one much more. They start where they were fitted
    `alone`, too.
    """
    some, fair = part_of(bench, base, alone or {}), _fair(base, bench.series)
    begun = [(layer, _begun(some, candidate)) for layer, candidate in known]
    ahead, behind = _apart(begun, lambda one: some.base.cost - one.cost)
    hints = [(layer, _hinted(bench, some, one, base, least)) for layer, one in ahead]
    near, far = _apart(hints, lambda hint: hint.gain)
    found = [Promise(layer, some.base.cost - one.cost) for layer, one in behind]
    found += [Promise(layer, hint.gain) for layer, hint in far]
    places = {True: 0, False: 0}
    for layer, hint in sorted(near, key=lambda one: -one[1].gain):
        places[hint.is_seen] += 1
        start = None
        if hint.gain >= least and places[hint.is_seen] <= MOST_ON_ALL:
            start = _on_all(bench, some, base, hint)
        gain = hint.gain if start is None else fair - start.cost
        found.append(Promise(layer, gain, start))
    return sorted(found, key=lambda one: -one.gain)


def _apart(
    some: Sequence[tuple[Layer, One]], gain: Callable[[One], float]
) -> tuple[list[tuple[Layer, One]], list[tuple[Layer, One]]]:
    """Return candidates that are near the best one by what they `gain` [nats], and the others."""
    gains = [gain(one) for _, one in some]
    most = max(gains, default=0.0)
    least = BEHIND * most if most > STRONG else -np.inf
    return (
        [pair for pair, each in zip(some, gains, strict=True) if each >= least],
        [pair for pair, each in zip(some, gains, strict=True) if not each >= least],
    )


def part_of(bench: Bench, base: Estimate, alone: Fits) -> Part:
    """Return the recordings to begin with, spread over all."""
    count = len(bench.series)
    screened = min(max(round(SCREENED_PART * count), FEWEST_SCREENED), MOST_SCREENED)
    if count <= screened:
        return Part(list(range(count)), bench, base, alone)
    rows = [round(k * (count - 1) / (screened - 1)) for k in range(screened)]
    series = tuple(bench.series[row] for row in rows)
    parts = [base.outcome.parts[row] for row in rows]
    columns = {name: np.concatenate([c[p] for p in parts]) for name, c in base.columns.items()}
    seen = seen_at(base, series, Point(base.point.shared, base.point.own[rows]))
    own = dataclasses.replace(bench, series=series)
    seen = dataclasses.replace(seen, columns=columns)
    return Part(rows, own, dataclasses.replace(seen, cost=_fair(seen, series)), alone)


def _fair(base: Estimate, series: Sequence[Series]) -> float:
    """Return the cost [nats] of a base that takes the steps that candidates take, with gains made
    where it begins: those that it was left with may fit better by accident.
    """
    here = looked_at(base.candidate, series, base.noises, base.point, base.outcome)
    return regained(reached(here, series, base.columns, SCREENED_ROUNDS), series).cost


@dataclass(frozen=True)
class _Hint:
    """What a candidate `found` on some recordings, of which these have `seen` anything or none has;
    its `gain` [nats] is that of as many as there are, its `point` one of all.
    """

    found: Estimate = field(repr=False)
    point: Point = field(repr=False)
    gain: float
    is_seen: bool = True


def _begun(some: Part, candidate: Candidate) -> Estimate:
    """Return a candidate few steps from the best of its starts, on some recordings."""
    starts = _starts(some, candidate)
    make = partial(_raced, some, candidate, starts)
    base = some.base
    given = [base.candidate, base.point, base.noises, base.columns, *starts]
    return some.bench.kept("begun", candidate, given, make)


def _hinted(bench: Bench, some: Part, begun: Estimate, base: Estimate, least: float) -> _Hint:
    """Return what some recordings say of a candidate; where that is nothing, what all say of where
    it starts and of where it was led to: some show themselves in few recordings alone.
    """
    candidate = begun.candidate
    make = partial(_gone_on, some, begun)
    given = [base.candidate, base.columns, begun.point, begun.noises, begun.gains]
    found = some.bench.kept("hinted", candidate, given, make)
    gain = some.base.cost - found.cost
    whole = extended(candidate, base.candidate, base.point, {})
    whole.own[some.rows] = found.point.own
    point = Point(found.point.shared, whole.own)
    if gain >= least or some.bench is bench:
        return _Hint(found, point, gain * len(bench.series) / len(some.rows))
    first = extended(candidate, base.candidate, base.point, starts_of(candidate, base.values(0))[0])
    ends = [seen_at(found, bench.series, point)]
    if seen_at(found, some.bench.series, some.point(first)).cost < some.base.cost + LOST:
        ends.append(looked_like(candidate, bench.series, base.noises, first, base))
    best = min(ends, key=lambda one: one.cost)
    return _Hint(found, best.point, base.cost - best.cost, is_seen=False)


def _on_all(bench: Bench, some: Part, base: Estimate, hint: _Hint) -> Estimate:
    """Return a candidate some steps further on all recordings: from where some led it, and from its
    starts where these show nothing of it.
    """
    if some.bench is bench:
        return hint.found
    candidate = hint.found.candidate
    whole = Part(list(range(len(bench.series))), bench, base, some.alone)
    starts = [hint.point, *_starts(whole, candidate)]
    make = partial(_reached, whole, candidate, starts)
    given = [base.candidate, base.point, base.noises, base.columns, *starts]
    return bench.kept("screened", candidate, given, make)


def _starts(part: Part, candidate: Candidate) -> list[Point]:
    base = part.base
    starts = starts_of(candidate, base.values(0))
    known = part.alone.get(candidate.layers[-1].id, {}) if candidate.layers else {}
    if known and known.keys() <= starts[0].keys():
        starts.append({**starts[0], **known})
    return [extended(candidate, base.candidate, base.point, start) for start in starts]


def _reached(part: Part, candidate: Candidate, starts: Sequence[Point]) -> Estimate:
    """Return a candidate some steps from the best of some starts, on a part of the recordings."""
    return _gone_on(part, _raced(part, candidate, starts))


def _raced(part: Part, candidate: Candidate, starts: Sequence[Point]) -> Estimate:
    """Return a candidate few steps from the best of some starts.

    How the base's parameters act is taken from the base.
    """
    series = part.bench.series
    found: list[Estimate] = []
    near: Outcome | None = None
    for point in starts:
        here = (
            looked_like(candidate, series, part.base.noises, point, part.base)
            if near is None
            else looked_at(candidate, series, part.base.noises, point, near)
        )
        near = here.outcome if here.outcome.is_whole else near
        found.append(turned(here, series))
    found.sort(key=lambda one: one.cost)
    most = STARTS_BESIDE if part.base.candidate.layers else STARTS
    race = [reached(here, series, part.base.columns, RACE) for here in found[:most]]
    return min(race, key=lambda one: one.cost)


def _gone_on(part: Part, begun: Estimate) -> Estimate:
    """Return a candidate some steps further, its phases turned again where that is better."""
    series, columns = part.bench.series, part.base.columns
    best = regained(reached(begun, series, columns, SCREENED_ROUNDS - RACE), series)
    again = turned(best, series)
    if again.cost > best.cost - HINT:
        return best
    return regained(reached(again, series, columns, SCREENED_ROUNDS), series)


def starts_of(candidate: Candidate, base: Mapping[str, float]) -> list[dict[str, float]]:
    """Return where a fit may start: each start of the parameters that the base does not have."""
    own = [one for one in candidate.uncertain if one.name not in base]
    most = max((len(one.starts) for one in own if not one.per_recording), default=1)
    return [{one.name: one.starts[min(k, len(one.starts) - 1)] for one in own} for k in range(most)]
