"""Observed run: the rows, transitions and active modes of a run, on which conditions are evaluated.

Modes are known at each instant and micro-step, signals at recorded rows only.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory
from expectation.expectations import Condition, ModePredicate, RegionRef, RunningStatistic
from expectation.name_resolution import (
    format_region,
    is_chart,
    leaf_modes_entered,
    mode_signals,
    path_of_mode,
)
from language.ir.expression_type import is_whole
from language.ir.ops import Expr, Ref, Value
from language.loading.mode_entry_event import ModeEntryEvent
from language.lowering.expressions import lower_assigned_value, lower_expression
from language.model.system import System
from language.numerics.evaluate import evaluate
from language.readers.mode_reader import IMPLICIT_MODE
from language.typecheck.types import EnumType, ExprType, IntType

NO_ROW = -1
"""The row of a point that is not a recorded row."""
TIME_TOLERANCE_ULPS = 4.0
"""Times that differ by at most so many units in the last place are equal: sums of two roundings."""


@dataclass(frozen=True)
class Point:
    """An instant [s] of a run: a recorded row, or a transition of the region `moved`."""

    time: float
    row: int
    moved: RegionRef | None = None


@dataclass(frozen=True)
class ObservedRun:
    """The points of a run in order of time, and the active mode of each region at each point."""

    points: tuple[Point, ...]
    modes: Mapping[RegionRef, Sequence[str]]
    signals: Mapping[str, Sequence[Any]]
    units: Mapping[str, str]
    events: tuple[Event, ...]
    end: float
    system: System

    def modes_at(self, point: int) -> dict[str, str]:
        """Return the active modes at a point by `instance` or `instance.region`.

        `point` is an index of `points`. The implicit mode of an automaton without modes is left
        out.
        """
        return {
            format_region(place): found[point]
            for place, found in self.modes.items()
            if found[point] != IMPLICIT_MODE
        }

    def times_of(self, event: ModeEntryEvent) -> list[float]:
        """Return the times [s] of an event in ascending order.

        An event without a source is the entry of its target from any mode. In a chart such an event
        also occurs at a point at which a leaf mode inside the target becomes active; equal times
        count once.
        """
        is_tree = is_chart(self.system, event.instance)
        names = (event.source, event.target)
        if is_tree:
            names = (event.source and path_of_mode(event.region, event.source),
                     path_of_mode(event.region, event.target))  # fmt: skip
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
        stay = ModePredicate((event.instance, event.region), leaf_modes_entered(self.system, event))
        return sorted({*exact, *self._entry_times(stay)})

    def _entry_times(self, predicate: ModePredicate) -> list[float]:
        """Return the times [s] of the points at which a predicate becomes true."""
        found, before = [], self.modes[predicate.region_ref][0] in predicate.modes
        for point, mode in zip(self.points, self.modes[predicate.region_ref], strict=True):
            if mode in predicate.modes and not before:
                found.append(point.time)
            before = mode in predicate.modes
        return found

    def mode_entries(self, region_ref: RegionRef, since: int) -> list[tuple[int, str]]:
        """Return (point, mode) for each entry of a mode in a region after the point `since`.

        `since` is an index of `points`. A transition to the same mode counts too, but not in a
        chart.
        """
        modes = self.modes[region_ref]
        is_tree = is_chart(self.system, region_ref[0])
        return [
            (k, modes[k])
            for k in range(since + 1, len(modes))
            if modes[k] != modes[k - 1] or (self.points[k].moved == region_ref and not is_tree)
        ]


@dataclass(frozen=True)
class Series:
    """The values of an expression at some points of a run, in order."""

    points: tuple[int, ...]
    values: tuple[Any, ...]


def observe_run(system: System, trajectory: Trajectory) -> ObservedRun:
    """Return the observation of a trajectory.

    Point 0 is at time 0, before all transitions; transitions come before a row at the same time.
    The modes of charts come from recorded rows; a region of a chart whose mode is not recorded has
    none.
    """
    moves = [event for event in trajectory.events if event.kind == "transition"]
    moves.sort(key=lambda event: event.time)
    chart_modes = _recorded_chart_modes(system, trajectory)
    active: dict[RegionRef, str] = {
        (name, region.name): region.initial
        for name, instance in system.instances.items()
        for region in instance.automaton.all_regions
        if not is_chart(system, name) or (name, region.name) in chart_modes
    }
    points: list[Point] = []
    modes: dict[RegionRef, list[str]] = {place: [] for place in active}

    def add(point: Point) -> None:
        if point.row != NO_ROW:
            active.update((place, line[point.row]) for place, line in chart_modes.items())
        points.append(point)
        for place, mode in active.items():
            modes[place].append(mode)

    rows = [(time, 1, row) for row, time in enumerate(trajectory.times.tolist())]
    active.update((place, line[0]) for place, line in chart_modes.items() if line)
    add(Point(0.0, NO_ROW))
    for time, is_row, number in heapq.merge(((m.time, 0, k) for k, m in enumerate(moves)), rows):
        if is_row:
            add(Point(time, number))
            continue
        move = moves[number]
        place = (move.instance, move.region)
        if place in active and not is_chart(system, move.instance):
            active[place] = move.target
        add(Point(time, NO_ROW, place))
    signals = {name: values.tolist() for name, values in trajectory.signals.items()}
    end = points[-1].time
    return ObservedRun(tuple(points), modes, signals, trajectory.units, tuple(moves), end, system)


def _recorded_chart_modes(system: System, trajectory: Trajectory) -> dict[RegionRef, list[str]]:
    """Return the mode names of charts at each row, by region, as far as they are recorded."""
    found = {}
    for name in system.instances:
        if is_chart(system, name):
            for signal, place in mode_signals(system, name).items():
                if signal in trajectory.signals:
                    names = trajectory.modes[signal]
                    found[place] = [names[k] for k in trajectory.signals[signal].tolist()]
    return found


def evaluate_series(condition: Condition, run: ObservedRun) -> Series:
    """Return the values of a condition at all points where it is known.

    With signals these are the recorded rows, else all points. `count` and `rms` of a quantity
    before its first value are 0 and NaN, `first` is NaN until its condition holds. Raises KeyError
    for a signal that was not recorded.
    """
    by_row = bool(condition.all_signals)
    points = [k for k, point in enumerate(run.points) if not by_row or point.row != NO_ROW]
    columns: list[list[Any]] = []
    known: dict[str, Expr] = {name: Value(number) for name, number in condition.literals.items()}
    for name, kind in condition.signals.items():
        values, convert = run.signals[name], _converter_of(kind)
        columns.append([convert(values[run.points[k].row]) for k in points])
        known[name] = Ref(name, is_integer=isinstance(kind, IntType | EnumType))
    for name, stay in condition.mode_predicates.items():
        modes = run.modes[stay.region_ref]
        columns.append([modes[k] in stay.modes for k in points])
        known[name] = Ref(name)
    for name, flag in condition.flags.items():
        words = run.signals[flag.signal]
        columns.append([bool(words[run.points[k].row] >> flag.bit & 1) for k in points])
        known[name] = Ref(name)
    for name, running in condition.running.items():
        made = _evaluate_running(running, run)
        columns.append([made[k] for k in points])
        known[name] = Ref(name, is_integer=running.function == "count")
    names = [*condition.signals, *condition.mode_predicates, *condition.flags, *condition.running]
    tree = condition.formula.tree
    expr = lower_expression(tree, known)
    expr = lower_assigned_value(tree, known, False) if is_whole(expr) else expr
    cache: dict[tuple[Any, ...], Any] = {}
    values_at_points = []
    for values in zip(*columns, strict=True) if columns else [()] * len(points):
        if values not in cache:
            cache[values] = evaluate(expr, dict(zip(names, values, strict=True)))
        values_at_points.append(cache[values])
    return Series(tuple(points), tuple(values_at_points))


def point_at_or_before(run: ObservedRun, time: float) -> int:
    """Return the index of the last point that is not later than a time [s]; 0 if all are later.

    Times within `time_tolerance` are equal.
    """
    limit = time + time_tolerance(time)
    last = 0
    for k, point in enumerate(run.points):
        if point.time > limit:
            break
        last = k
    return last


def time_tolerance(time: float) -> float:
    """Return the difference [s] up to which two times are equal.

    It is TIME_TOLERANCE_ULPS units in the last place of `time`.
    """
    return TIME_TOLERANCE_ULPS * math.ulp(time)


def _evaluate_running(running: RunningStatistic, run: ObservedRun) -> list[Any]:
    """Return the value of a running statistic at each point.

    Between the points where its operand is known the value is constant.
    """
    found: list[Any] = [0 if running.function == "count" else math.nan] * len(run.points)
    if isinstance(running.operand, tuple):
        return list(itertools.accumulate(int(p.moved == running.operand) for p in run.points))
    inner = evaluate_series(running.operand, run)
    values = dict(zip(inner.points, inner.values, strict=True))
    now, squares, rows, before = found[0], 0.0, 0, False
    for k, point in enumerate(run.points):
        if k in values:
            value = values[k]
            if running.function == "count":
                now, before = now + (bool(value) and not before), bool(value)
            elif running.function == "first":
                now = point.time if value and now != now else now
            elif point.time >= float(running.since) - time_tolerance(point.time):
                squares, rows = squares + float(value) ** 2, rows + 1
                now = math.sqrt(squares / rows)
        found[k] = now
    return found


def _converter_of(kind: ExprType) -> Any:
    """Return the Python type of the values of a type: bool, int or float."""
    if kind == "truth":
        return bool
    return int if isinstance(kind, IntType | EnumType) else float
