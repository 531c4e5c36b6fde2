"""Screening: what candidates promise by steps from their starts: on some recordings, then all."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from diagnosis.adaptation import turned
from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimation import (
    SCREENED_ROUNDS,
    Estimate,
    looked_at,
    reached,
    regained,
    seen_at,
)
from diagnosis.layers import Layer
from diagnosis.point import Point, extended
from diagnosis.prediction import Outcome

MOST_SCREENED = 5
"""Recordings that candidates are screened on first, spread over all."""
MOST_ON_ALL = 10
"""Candidates that are then screened on all, those that gained most; and as many again at most that
the others alone may show."""
HINT = 2.0
"""Nats that a candidate gains at least, if it is to be looked at further."""
STARTS = 2
"""Starts of a candidate from which steps are made, the best ones."""
RACE = 6
"""Steps from each of them; then the better one goes on alone."""
Known = tuple[Layer, Candidate]


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
    """Some recordings, the `rows` of a bench, as a `bench` of their own, with the `base` there."""

    rows: list[int]
    bench: Bench
    base: Estimate = field(repr=False)

    def point(self, whole: Point) -> Point:
        """Return a point of all recordings for these."""
        return Point(whole.shared, whole.own[self.rows])


def promises(bench: Bench, base: Estimate, known: Sequence[Known], least: float) -> list[Promise]:
    """Return what candidates promise, the best first; one that gains `least` [nats] is looked at on
    all recordings, unless many gain more.
    """
    some = part_of(bench, base)
    hints = [(layer, _hinted(bench, some, candidate, base, least)) for layer, candidate in known]
    hints.sort(key=lambda one: -one[1].gain)
    found: list[Promise] = []
    places = {True: 0, False: 0}
    for layer, hint in hints:
        places[hint.is_seen] += 1
        start = None
        if hint.gain >= least and places[hint.is_seen] <= MOST_ON_ALL:
            start = _on_all(bench, some, base, hint)
        gain = hint.gain if start is None else base.cost - start.cost
        found.append(Promise(layer, gain, start))
    return sorted(found, key=lambda one: -one.gain)


def part_of(bench: Bench, base: Estimate) -> Part:
    """Return the recordings to begin with, spread over all."""
    count = len(bench.series)
    if count <= MOST_SCREENED:
        return Part(list(range(count)), bench, base)
    rows = [round(k * (count - 1) / (MOST_SCREENED - 1)) for k in range(MOST_SCREENED)]
    series = tuple(bench.series[row] for row in rows)
    parts = [base.outcome.parts[row] for row in rows]
    columns = {name: np.concatenate([c[p] for p in parts]) for name, c in base.columns.items()}
    seen = seen_at(base, series, Point(base.point.shared, base.point.own[rows]))
    own = dataclasses.replace(bench, series=series)
    return Part(rows, own, dataclasses.replace(seen, columns=columns))


@dataclass(frozen=True)
class _Hint:
    """What a candidate `found` on some recordings, of which these have `seen` anything or none has;
    its `gain` [nats] is that of as many as there are, its `point` one of all.
    """

    found: Estimate = field(repr=False)
    point: Point = field(repr=False)
    gain: float
    is_seen: bool = True


def _hinted(bench: Bench, some: Part, candidate: Candidate, base: Estimate, least: float) -> _Hint:
    """Return what some recordings say of a candidate; where that is nothing, what all say of where
    it starts and of where it was led to: some show themselves in few recordings alone.
    """
    make = partial(_reached, some, candidate, _starts(some, candidate))
    given = [some.base.candidate, some.base.point, some.base.noises, some.base.columns]
    found = some.bench.kept("hinted", candidate, given, make)
    gain = some.base.cost - found.cost
    whole = extended(candidate, base.candidate, base.point, {})
    whole.own[some.rows] = found.point.own
    point = Point(found.point.shared, whole.own)
    if gain >= least or some.bench is bench:
        return _Hint(found, point, gain * len(bench.series) / len(some.rows))
    first = extended(candidate, base.candidate, base.point, starts_of(candidate, base.values(0))[0])
    ends = [
        seen_at(found, bench.series, point),
        looked_at(candidate, bench.series, base.noises, first),
    ]
    best = min(ends, key=lambda one: one.cost)
    return _Hint(found, best.point, base.cost - best.cost, is_seen=False)


def _on_all(bench: Bench, some: Part, base: Estimate, hint: _Hint) -> Estimate:
    """Return a candidate some steps further on all recordings: from where some led it, and from its
    starts where these show nothing of it.
    """
    if some.bench is bench:
        return hint.found
    candidate = hint.found.candidate
    whole = Part(list(range(len(bench.series))), bench, base)
    starts = [hint.point, *_starts(whole, candidate)]
    make = partial(_reached, whole, candidate, starts)
    given = [base.candidate, base.point, base.noises, base.columns, *starts]
    return bench.kept("screened", candidate, given, make)


def _starts(part: Part, candidate: Candidate) -> list[Point]:
    base = part.base
    starts = starts_of(candidate, base.values(0))
    return [extended(candidate, base.candidate, base.point, start) for start in starts]


def _reached(part: Part, candidate: Candidate, starts: Sequence[Point]) -> Estimate:
    """Return a candidate some steps from the best of some starts, on a part of the recordings.

    How the base's parameters act is taken from the base.
    """
    series, columns = part.bench.series, part.base.columns
    found: list[Estimate] = []
    near: Outcome | None = None
    for point in starts:
        here = looked_at(candidate, series, part.base.noises, point, near)
        near = here.outcome if here.outcome.is_whole else near
        found.append(turned(here, series))
    found.sort(key=lambda one: one.cost)
    race = [reached(here, series, columns, RACE) for here in found[:STARTS]]
    best = min(race, key=lambda one: one.cost)
    best = regained(reached(best, series, columns, SCREENED_ROUNDS - RACE), series)
    again = turned(best, series)
    if again.cost > best.cost - HINT:
        return best
    return regained(reached(again, series, columns, SCREENED_ROUNDS), series)


def starts_of(candidate: Candidate, base: Mapping[str, float]) -> list[dict[str, float]]:
    """Return where a fit may start: each start of the parameters that the base does not have."""
    own = [one for one in candidate.uncertain if one.name not in base]
    most = max((len(one.starts) for one in own if not one.per_recording), default=1)
    return [{one.name: one.starts[min(k, len(one.starts) - 1)] for one in own} for k in range(most)]
