"""Observed: a run as a test looks at it - its rows, its transitions, the modes at each of them.

Modes are known at every instant, in each micro-step; signals at the rows that are recorded.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from engine.trajectory import Event, Trajectory
from expectation.expected import Condition, Place, Running, Stay
from expectation.places import inside, is_chart, mode_signals, path_of, said
from language.evaluate import evaluate
from language.event_name import EventName
from language.experiment import System
from language.kind import Enumeration, Kind, Whole
from language.lower import assigned, expression, is_whole
from language.mode import ALWAYS
from language.operation import Expr, Ref, Value

BETWEEN = -1
"""The row of a point that lies between rows."""
ULPS = 4.0
"""Times that differ by so many units in the last place are one: a sum of two rounds twice."""


@dataclass(frozen=True)
class Point:
    """An instant at which a run is looked at [s], its row, and the region that has just moved."""

    time: float
    row: int
    moved: Place | None = None


@dataclass(frozen=True)
class Observed:
    """The points of a run in order, and the active modes at each."""

    points: tuple[Point, ...]
    modes: Mapping[Place, Sequence[str]]
    signals: Mapping[str, Sequence[Any]]
    units: Mapping[str, str]
    events: tuple[Event, ...]
    end: float
    system: System

    def modes_at(self, point: int) -> dict[str, str]:
        """Return the active modes at a point by `instance` or `instance.region`.

        That an automaton without modes, or whose regions have them all, is `always` is not told.
        """
        return {
            said(place): found[point]
            for place, found in self.modes.items()
            if found[point] != ALWAYS
        }

    def times_of(self, event: EventName) -> list[float]:
        """Return when an event happened [s].

        In a chart a mode is entered by what enters it, and by whatever makes it active.
        """
        is_tree = is_chart(self.system, event.instance)
        names = (event.source, event.target)
        if is_tree:
            names = (event.source and path_of(event.region, event.source),
                     path_of(event.region, event.target))  # fmt: skip
        exact = [
            one.time
            for one in self.events
            if one.instance == event.instance
            and names[1] in one.target.split(", ")
            and (is_tree or one.region == event.region)
            and names[0] in ("", one.source)
        ]
        if not is_tree or event.source:
            return exact
        stay = Stay((event.instance, event.region), inside(self.system, event))
        return sorted({*exact, *self._rises(stay)})

    def _rises(self, stay: Stay) -> list[float]:
        found, before = [], self.modes[stay.place][0] in stay.modes
        for point, mode in zip(self.points, self.modes[stay.place], strict=True):
            if mode in stay.modes and not before:
                found.append(point.time)
            before = mode in stay.modes
        return found

    def entered(self, place: Place, since: int) -> list[tuple[int, str]]:
        """Return the points after one at which a region entered a mode, and that mode."""
        modes = self.modes[place]
        is_tree = is_chart(self.system, place[0])
        return [
            (k, modes[k])
            for k in range(since + 1, len(modes))
            if modes[k] != modes[k - 1] or (self.points[k].moved == place and not is_tree)
        ]


@dataclass(frozen=True)
class Series:
    """A value at some points of a run, in their order."""

    points: tuple[int, ...]
    values: tuple[Any, ...]


def observed(system: System, trajectory: Trajectory) -> Observed:
    """Return what a test sees of a run; the modes of charts are those of the rows."""
    moves = [event for event in trajectory.events if event.kind == "transition"]
    moves.sort(key=lambda event: event.time)
    told = _told(system, trajectory)
    active: dict[Place, str] = {
        (name, region.name): region.initial
        for name, instance in system.instances.items()
        for region in instance.automaton.all_regions
        if not is_chart(system, name) or (name, region.name) in told
    }
    points: list[Point] = []
    modes: dict[Place, list[str]] = {place: [] for place in active}

    def add(point: Point) -> None:
        if point.row != BETWEEN:
            active.update((place, line[point.row]) for place, line in told.items())
        points.append(point)
        for place, mode in active.items():
            modes[place].append(mode)

    rows = [(time, 1, row) for row, time in enumerate(trajectory.times.tolist())]
    active.update((place, line[0]) for place, line in told.items() if line)
    add(Point(0.0, BETWEEN))
    for time, is_row, number in heapq.merge(((m.time, 0, k) for k, m in enumerate(moves)), rows):
        if is_row:
            add(Point(time, number))
            continue
        move = moves[number]
        place = (move.instance, move.region)
        if place in active and not is_chart(system, move.instance):
            active[place] = move.target
        add(Point(time, BETWEEN, place))
    signals = {name: values.tolist() for name, values in trajectory.signals.items()}
    end = points[-1].time
    return Observed(tuple(points), modes, signals, trajectory.units, tuple(moves), end, system)


def _told(system: System, trajectory: Trajectory) -> dict[Place, list[str]]:
    """Return the modes of charts at each row, where they are recorded."""
    found = {}
    for name in system.instances:
        if is_chart(system, name):
            for signal, place in mode_signals(system, name).items():
                if signal in trajectory.signals:
                    names = trajectory.modes[signal]
                    found[place] = [names[k] for k in trajectory.signals[signal].tolist()]
    return found


def series(condition: Condition, seen: Observed) -> Series:
    """Return the value of an expression at the points at which it is known."""
    by_row = bool(condition.all_signals)
    points = [k for k, point in enumerate(seen.points) if not by_row or point.row != BETWEEN]
    columns: list[list[Any]] = []
    known: dict[str, Expr] = {name: Value(number) for name, number in condition.literals.items()}
    for name, kind in condition.signals.items():
        values, convert = seen.signals[name], _converted(kind)
        columns.append([convert(values[seen.points[k].row]) for k in points])
        known[name] = Ref(name, whole=isinstance(kind, Whole | Enumeration))
    for name, stay in condition.stays.items():
        modes = seen.modes[stay.place]
        columns.append([modes[k] in stay.modes for k in points])
        known[name] = Ref(name)
    for name, flag in condition.flags.items():
        words = seen.signals[flag.signal]
        columns.append([bool(words[seen.points[k].row] >> flag.bit & 1) for k in points])
        known[name] = Ref(name)
    for name, running in condition.running.items():
        made = _running(running, seen)
        columns.append([made[k] for k in points])
        known[name] = Ref(name, whole=running.function == "count")
    names = [*condition.signals, *condition.stays, *condition.flags, *condition.running]
    tree = condition.formula.tree
    expr = expression(tree, known)
    expr = assigned(tree, known, False) if is_whole(expr) else expr
    kept: dict[tuple[Any, ...], Any] = {}
    found = []
    for values in zip(*columns, strict=True) if columns else [()] * len(points):
        if values not in kept:
            kept[values] = evaluate(expr, dict(zip(names, values, strict=True)))
        found.append(kept[values])
    return Series(tuple(points), tuple(found))


def at_or_before(seen: Observed, time: float) -> int:
    """Return the last point that is not after a time [s]."""
    limit = time + slack(time)
    last = 0
    for k, point in enumerate(seen.points):
        if point.time > limit:
            break
        last = k
    return last


def slack(time: float) -> float:
    """Return by how much two floats may differ that are one time [s]."""
    return ULPS * math.ulp(time)


def _running(running: Running, seen: Observed) -> list[Any]:
    """Return a number of the run so far at each point: what it was at the last one it is known."""
    found: list[Any] = [0 if running.function == "count" else math.nan] * len(seen.points)
    if isinstance(running.of, tuple):
        return list(itertools.accumulate(int(p.moved == running.of) for p in seen.points))
    inner = series(running.of, seen)
    values = dict(zip(inner.points, inner.values, strict=True))
    now, squares, rows, before = found[0], 0.0, 0, False
    for k, point in enumerate(seen.points):
        if k in values:
            value = values[k]
            if running.function == "count":
                now, before = now + (bool(value) and not before), bool(value)
            elif running.function == "first":
                now = point.time if value and now != now else now
            elif point.time >= float(running.since) - slack(point.time):
                squares, rows = squares + float(value) ** 2, rows + 1
                now = math.sqrt(squares / rows)
        found[k] = now
    return found


def _converted(kind: Kind) -> Any:
    if kind == "truth":
        return bool
    return int if isinstance(kind, Whole | Enumeration) else float
