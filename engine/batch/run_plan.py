"""Run plan: the instants, steps, rows, inputs and noise of a run as flat arrays for compiled C.

They follow from the scenario alone. Times are exact here, as integer multiples of a common tick,
and are passed to C as sums of two doubles.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from engine.batch.build_system_program import assembly_of
from engine.results.array_types import Reals
from engine.simulation.event_schedule import Schedule, TimeGrid
from engine.simulation.sensors import noise_stream
from engine.simulation.signal_values import DelayLine
from engine.simulation.stimuli import InputSignal
from language.ir.program import Program
from language.model.system import Scenario, System
from language.programs.system_program import InputTrajectory as Varying, SimulationAssembly

Integers = NDArray[np.int64]
MAX_TICKS = 2**52
"""Largest number of common ticks in a horizon; a double counts them exactly."""
MAX_SCHEDULE_BITS = 32
"""Number of bits in the word that says what happens at an instant."""
LARGEST_FACTOR = 2**996
"""Largest slope of an input [1/s]: Dekker's product multiplies it by 2^27 + 1 in a double."""
NO_ROW = -1
"""Index that stands for no row or no step."""


@dataclass(frozen=True)
class DoubleDoubleTimes:
    """Times [s] as sums of two doubles (n,)."""

    high: Reals
    low: Reals


@dataclass(frozen=True)
class StepPlan:
    """Steps of one continuous instance.

    `first` (instants + 1,) is the first step that leads to each instant. `left` (steps,) are the
    lengths [s] and `starts` (steps + 1,) the times of the steps. For each row (rows,): `row_steps`
    is its step (`NO_ROW` at an instant), `row_times` the time [s] since the start of the step, and
    `row_ends` whether the row is at the end of the step. `boundaries` (steps + 1,) tells which
    times are whole major steps.
    """

    first: Integers
    left: Reals
    starts: DoubleDoubleTimes
    row_steps: Integers
    row_times: DoubleDoubleTimes
    row_ends: NDArray[np.uint8]
    boundaries: NDArray[np.uint8]


@dataclass(frozen=True)
class RunPlan:
    """Arrays of one scenario.

    `inputs` (instants, inputs) are values, `happens` (instants,) bits of what happens, `row_at`
    (instants,) the row of each instant or `NO_ROW`, `rows` (rows,) the times of rows [s],
    `row_gaps` (rows,) the first instant that is not before each row. `flows` are the steps by
    continuous instance. `noise` are standard normal numbers by sensor, `early` the number of
    samples of a sensor before its first delayed one arrives. Inputs that change between instants
    have `pieces` (instants, trajectories) and `courses` (pieces, 6) with start, value and slope of
    each piece. `exact` are the instants [s].
    """

    instants: DoubleDoubleTimes
    inputs: Reals
    happens: NDArray[np.uint32]
    row_at: Integers
    rows: DoubleDoubleTimes
    row_gaps: Integers
    flows: Mapping[str, StepPlan]
    noise: Mapping[str, Reals]
    early: Mapping[str, int]
    exact: tuple[Fraction, ...] = ()
    pieces: Integers = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    courses: Mapping[str, Reals] = field(default_factory=dict)

    def pieces_at(self, starts: Sequence[Fraction]) -> Integers:
        """Return the index of the piece at each instant (instants,); 0 before the first start."""
        at = [bisect_right(starts, time) - 1 for time in self.exact]
        return np.maximum(np.array(at, dtype=np.int64), 0)


def planning_obstacle(
    system: System, scenario: Scenario, programs: Mapping[str, Program]
) -> str | None:
    """Return the reason why a run has no plan; None if it has one."""
    if scenario.calibrations:
        return "a page of the calibration turns during the run"
    for name, line in system.delayed_signals.items():
        if line.source not in system.inputs:
            return f"`{name}` is a delayed output"
    flows = {name for name, program in programs.items() if program.period is None}
    for name, sensor in system.sensors.items():
        if sensor.period is None:
            return f"sensor `{name}` has no `sample`"
        if sensor.lag and sensor.source.partition(".")[0] not in flows:
            return f"sensor `{name}` has a lag on a sampled output"
    for name, stimulus in scenario.inputs.items():
        if any(abs(piece.slope) > LARGEST_FACTOR for piece in stimulus.pieces):
            return f"input `{name}` is too steep for a product of two doubles"
    if len(assembly_of(system, scenario, programs).instant_actions) > MAX_SCHEDULE_BITS:
        return f"more than {MAX_SCHEDULE_BITS} things tick, sample or arrive"
    if _tick(Schedule(system, scenario, dict(programs)), programs) is None:
        return "its times have no common tick that a double counts"
    return None


def build_run_plan(system: System, scenario: Scenario, assembly: SimulationAssembly) -> RunPlan:
    """Return the plan of a resolved scenario without planning obstacle."""
    programs = assembly.programs
    schedule = Schedule(system, scenario, dict(programs))
    tick = _tick(schedule, programs)
    assert tick is not None
    end = int(schedule.horizon / tick)
    grids = {name: _ticks(grid, tick, end) for name, grid in schedule.grids().items()}
    events = [_ceiling(time, tick) for time in schedule.events if time <= schedule.horizon]
    instants = np.unique(np.concatenate([np.array([0, end, *events]), *grids.values()]))
    rows = _ticks(schedule.rows, tick, end)
    noise = {
        name: noise_samples(scenario.seed, name, len(grids[name]))
        for name, sensor in assembly.sensors.items()
        if sensor.noise
    }
    early = {
        name: int(np.sum(grids[name] < math.ceil(sensor.delay / tick)))
        for name, sensor in assembly.sensors.items()
    }
    return RunPlan(
        instants=_times(instants, tick),
        inputs=input_values(system, scenario, assembly, instants, tick),
        happens=_happens(instants, [grids[name] for name in assembly.instant_actions]),
        row_at=_row_at(instants, rows),
        rows=_times(rows, tick),
        row_gaps=np.searchsorted(instants, rows),
        flows={
            name: _flow_plan(int(programs[name].major_step / tick), instants, rows, tick)
            for name in assembly.continuous_instances
        },
        noise=noise,
        early=early,
        pieces=_course_pieces(system, scenario, assembly, instants, tick),
        courses={c.name: _course_table(system, scenario, c) for c in assembly.input_trajectories},
        exact=tuple(int(instant) * tick for instant in instants),
    )


def _ceiling(time: Fraction, tick: Fraction) -> int:
    """Return how many ticks a time has, rounded up; a second is a whole number of them."""
    return -(-time.numerator * tick.denominator // time.denominator)


def _happens(instants: Integers, grids: Sequence[Integers]) -> NDArray[np.uint32]:
    """Return what happens at each instant: a bit of each grid that has it."""
    found = np.zeros(len(instants), dtype=np.uint32)
    for bit, grid in enumerate(grids):
        found[np.searchsorted(instants, grid)] |= np.uint32(1 << bit)
    return found


def _row_at(instants: Integers, rows: Integers) -> Integers:
    """Return the number of the row at each instant; `NO_ROW` at an instant without row."""
    found = np.full(len(instants), NO_ROW, dtype=np.int64)
    at = np.isin(rows, instants, assume_unique=True)
    found[np.searchsorted(instants, rows[at])] = np.flatnonzero(at)
    return found


def noise_samples(seed: int, sensor: str, count: int) -> Reals:
    """Return the first `count` noise numbers of a sensor (count,)."""
    return np.fromiter(islice(noise_stream(seed, sensor), count), dtype=np.float64, count=count)


def input_values(
    system: System,
    scenario: Scenario,
    assembly: SimulationAssembly,
    instants: Integers,
    tick: Fraction,
) -> Reals:
    """Return the values of the inputs (instants, inputs); varying inputs have 0.

    A piece is in effect from its start on.
    """
    found = np.zeros((len(instants), len(assembly.inputs)))
    for place, name in enumerate(assembly.inputs):
        line = system.delayed_signals.get(name)
        source, delay = (line.source, line.delay) if line else (name, Fraction(0))
        if scenario.inputs[source].varies:
            continue
        course = InputSignal(source, scenario.inputs[source], _no_formula)
        later = [piece.start + delay for piece in course.pieces] if delay else course.starts
        starts = [_ceiling(start, tick) for start in later]
        values = [float(course.constant_value(piece)) for piece in course.pieces]
        if line:
            values[0] = float(DelayLine(line, course).at(Fraction(0)))
        pieces = np.maximum(np.searchsorted(np.array(starts), instants, side="right") - 1, 0)
        found[:, place] = np.array(values)[pieces]
    return found


def _course_pieces(
    system: System,
    scenario: Scenario,
    assembly: SimulationAssembly,
    instants: Integers,
    tick: Fraction,
) -> Integers:
    """Return the piece of each course that holds from each instant on (instants, courses)."""
    found = np.zeros((len(instants), max(1, len(assembly.input_trajectories))), dtype=np.int64)
    for place, course in enumerate(assembly.input_trajectories):
        line = system.delayed_signals.get(course.name)
        stimulus = scenario.inputs[line.source if line else course.name]
        starts = [_ceiling(piece.start + course.delay, tick) for piece in stimulus.pieces]
        at = np.searchsorted(np.array(starts), instants, side="right") - 1
        found[:, place] = np.maximum(at, 0)
    return found


def _course_table(system: System, scenario: Scenario, course: Varying) -> Reals:
    """Return start, value and slope of each piece, each as two doubles (pieces, 6)."""
    line = system.delayed_signals.get(course.name)
    stimulus = scenario.inputs[line.source if line else course.name]
    rows = [
        [part for exact in (piece.start, piece.value, piece.slope) for part in _two(exact)]
        for piece in stimulus.pieces
    ]
    return np.array(rows, dtype=np.float64)


def _two(exact: Fraction) -> tuple[float, float]:
    high = exact.numerator / exact.denominator
    rest = exact - Fraction(high)
    return high, rest.numerator / rest.denominator


def _no_formula(block: str, _time: float) -> float:
    raise AssertionError(f"{block} is a formula of time: not planned")


def _tick(schedule: Schedule, programs: Mapping[str, Program]) -> Fraction | None:
    """Return the largest time [s] of which every time of a run is a multiple."""
    times = [schedule.horizon, *schedule.events, schedule.rows.period]
    times += [time for grid in schedule.grids().values() for time in (grid.start, grid.period)]
    times += [program.major_step for program in programs.values()]
    bottom = math.lcm(*(time.denominator for time in times))
    return Fraction(1, bottom) if max(schedule.horizon, Fraction(1)) * bottom <= MAX_TICKS else None


def _ticks(grid: TimeGrid, tick: Fraction, end: int) -> Integers:
    return np.arange(int(grid.start / tick), end + 1, int(grid.period / tick), dtype=np.int64)


def _flow_plan(step: int, instants: Integers, rows: Integers, tick: Fraction) -> StepPlan:
    steps = np.arange(0, int(instants[-1]) + 1, step, dtype=np.int64)
    ends = np.union1d(steps, instants)
    first = np.concatenate([[0], np.searchsorted(ends, instants)]).astype(np.int64)
    inside = ~np.isin(rows, instants, assume_unique=True)
    of = np.searchsorted(ends, rows, side="left") - 1
    since = np.where(inside, rows - ends[np.maximum(of, 0)], 0)
    at_end = inside & np.isin(rows, ends, assume_unique=True)
    return StepPlan(
        first=first,
        left=np.diff(ends) / tick.denominator,
        starts=_times(ends, tick),
        row_steps=np.where(inside, of, NO_ROW).astype(np.int64),
        row_times=_times(since, tick),
        row_ends=at_end.astype(np.uint8),
        boundaries=(ends % step == 0).astype(np.uint8),
    )


def _times(ticks: Integers, tick: Fraction) -> DoubleDoubleTimes:
    """Return multiples n of a tick 1 / b as n / b, and what that division has left over."""
    bottom = float(tick.denominator)
    whole = ticks.astype(np.float64)
    high = whole / bottom
    product, rest = _product(high, bottom)
    low = ((whole - product) - rest) / bottom
    return DoubleDoubleTimes(high, low)


def _product(a: Reals, b: float) -> tuple[Reals, Reals]:
    """Return a b exactly as a sum of two doubles (Dekker 1971)."""
    split = 134217729.0  # 2^27 + 1
    a_high = a * split - (a * split - a)
    b_high = b * split - (b * split - b)
    a_low, b_low = a - a_high, b - b_high
    product = a * b
    rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, rest
