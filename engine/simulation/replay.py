"""Replay: executes a sampled automaton on the values of a recording, tick by tick.

Inputs are held at their latest recorded values. Outputs can be compared with columns of the
recording.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from engine.execution.transition_events import fired_by_micro_step, mode_names, transition_event
from engine.interpreter.interpreter import Interpreter, Stepper
from engine.recordings.recording import Channel, Recording
from engine.results.sampled_run import Event, SignalArray
from engine.results.trajectory import Trajectory, column_array, fault_names
from language.expressions.units import display_unit
from language.ir.program import Program, ValueType
from language.ir.root_region import CHART
from language.loading.recording_map_columns import pair_columns
from language.model.automaton import Automaton
from language.model.system import RecordingMap
from language.text.diagnostic import DataError, Problems, SpecError

MAX_TICKS = 20_000_000
"""Largest number of ticks of a replay."""


@dataclass(frozen=True)
class Comparison:
    """Difference of an output and a column of the recording, at the ticks with a new value.

    `rms` and `largest` are in `unit`.
    """

    output: str
    rms: float
    largest: float
    unit: str


@dataclass(frozen=True)
class Replay:
    """Result of a replay: a trajectory with one sample for each tick, inputs included.

    `innovation_rms` is the root mean square of the one-step innovation by measured input, over the
    ticks with a new value at which an observer was active.
    """

    trajectory: Trajectory
    innovation_rms: Mapping[str, float]
    comparisons: tuple[Comparison, ...]


def used_columns(automaton: Automaton, mapping: RecordingMap) -> tuple[list[str], list[str]]:
    """Return the columns of a map that an automaton reads or compares, and the names left out.

    Left out are columns and constants for inputs that the automaton lacks. Raises SpecError for an
    input without a column, constant or default, an input that is fed twice, a wrong dimension, an
    unknown output or an input column that is held `linear`.
    """
    problems = Problems()
    used, left_out = pair_columns(automaton, mapping, problems)
    for column in (mapping.columns[name] for name in used):
        if column.to is not None and column.hold == "linear":
            label = f"column `{column.name}` is held `linear`: a replay reads the latest"
            hint = "`hold: previous`; linear is for a scenario's `recording`"
            problems.error("form", column.span, label, hint)
    problems.raise_if_errors()
    left_out += [name for name in mapping.constants if name not in automaton.inputs]
    return used, left_out


def replay(
    automaton: Automaton,
    program: Program,
    recording: Recording,
    mapping: RecordingMap,
    build: Callable[[Program], Stepper] = Interpreter,
    on_tick: Callable[[Stepper], None] | None = None,
) -> Replay:
    """Replay a recording through a sampled automaton.

    Tick 0 is at the first time at which every input column has a value; tick k is k periods later,
    up to the end of the recording. An input keeps its value until the next stamp; inputs without a
    column have the constant of the map, else their default. The trajectory has inputs as
    `in.<name>`, outputs, and the mode of each region. `build` creates the stepper; `on_tick` is
    called after each tick. Raises DataError for a continuous Program, and SpecError if the number
    of ticks is not in 1 to `MAX_TICKS`.
    """
    if program.period is None:
        raise DataError(f"{program.name} is continuous: only a sampled automaton is replayed")
    stepper = build(program)
    feeds = [c for c in recording.channels.values() if c.column.to is not None]
    start = max(channel.times[0] for channel in feeds) if feeds else Fraction(0)
    count = int((recording.end - start) // program.period) + 1
    if count > MAX_TICKS or count < 1:
        problems = Problems()
        label = f"the recording spans {max(count, 0)} ticks of {program.period} s; "
        label += f"1 to {MAX_TICKS} is fine"
        place, hint = recording.place or mapping.span, _explain_span(recording, feeds)
        problems.error("range", place, label, hint)
        raise SpecError(problems.reported)
    _set_constants(automaton, program, mapping, stepper)
    recorder = _run_ticks(program, stepper, feeds, start, count, on_tick)
    word = stepper.get("memory.faults") if program.faults else 0
    faults = fault_names(automaton.name, program, word)
    trajectory = dataclasses.replace(recorder.trajectory(automaton.name), faults=faults)
    compared_channels = [c for c in recording.channels.values() if c.column.compare is not None]
    comparisons = [
        _compare_output(channel, trajectory, start, program, recording)
        for channel in compared_channels
    ]
    return Replay(trajectory, recorder.innovation_rms(), tuple(c for c in comparisons if c))


def _explain_span(recording: Recording, feeds: Sequence[Channel]) -> str:
    """Return the late start of an input, or the longest pause of the stamps, as a hint."""
    latest = max(feeds, key=lambda channel: channel.times[0], default=None)
    if latest is not None and latest.times[0] > recording.end:
        clock = f" (time `{latest.clock}`)" if latest.clock else ""
        text = f"`{latest.column.name}`{clock} begins at {float(latest.times[0]):.9g} s, "
        return text + f"the recording ends at {float(recording.end):.9g} s"
    stamps = [channel.seconds for channel in recording.channels.values()]
    ends = [float(recording.start), float(recording.end)]
    every = np.unique(np.concatenate([*stamps, ends]))
    if len(every) < 2:
        return ""
    k = int(np.argmax(np.diff(every)))
    return f"the longest pause of its time stamps is from {every[k]:.9g} s to {every[k + 1]:.9g} s"


def _run_ticks(
    program: Program,
    stepper: Stepper,
    channels: Sequence[Channel],
    start: Fraction,
    count: int,
    on_tick: Callable[[Stepper], None] | None,
) -> _TickRecorder:
    """Execute `count` ticks from `start` [s] and return the recorded rows.

    Each tick latches the channels and runs the block `step`.
    """
    assert program.period is not None
    cursors = [_ChannelCursor(channel, program) for channel in channels]
    recorder = _TickRecorder(program, [cursor.target for cursor in cursors])
    for tick in range(count):
        time = start + tick * program.period
        for cursor in cursors:
            cursor.advance(time, stepper)
        stepper.run("step")
        recorder.record(time, stepper)
        if on_tick:
            on_tick(stepper)
    return recorder


class _ChannelCursor:
    """Channel of a recording with the position up to which it is read."""

    def __init__(self, channel: Channel, program: Program) -> None:
        self.channel = channel
        self.target = f"input.{channel.column.to}"
        self.position = 0
        kinds = {variable.name: variable.type for variable in program.variables}
        flag = f"is_new.{channel.column.to}"
        self.flag = flag if flag in kinds else None
        self.kind = kinds[self.target]

    def advance(self, time: Fraction, stepper: Stepper) -> None:
        """Set the input to the latest value with a stamp up to `time` [s].

        The flag of the input, if it has one, tells whether the value is new since the last call.
        """
        times, position = self.channel.times, self.position
        while position < len(times) and times[position] <= time:
            position += 1
        is_new = position > self.position
        if is_new:
            value = self.channel.values[position - 1]
            stepper.set(self.target, _to_type(value, self.kind))
        self.position = position
        if self.flag:
            stepper.set(self.flag, is_new)


def _to_type(value: float, kind: ValueType) -> float | int | bool:
    """Return a number as a value of the type of a variable; whole numbers are rounded."""
    if kind == "truth":
        return value != 0.0
    return round(value) if kind == "whole" else value


def _set_constants(
    automaton: Automaton, program: Program, mapping: RecordingMap, stepper: Stepper
) -> None:
    """Set the inputs to their defaults, then to the constants of the map."""
    kinds = {variable.name: variable.type for variable in program.variables}
    for name, value in program.defaults.items():
        stepper.set(f"input.{name}", value)
    for name, (number, _) in mapping.constants.items():
        if name in automaton.inputs:
            stepper.set(f"input.{name}", _to_type(float(number), kinds[f"input.{name}"]))


class _TickRecorder:
    """Recorder of inputs, outputs, modes, events and innovations of each tick."""

    def __init__(self, program: Program, input_names: Sequence[str]) -> None:
        self.program = program
        self.names = {f"in.{name.partition('.')[2]}": name for name in input_names}
        self.names.update({wire.name: wire.source for wire in program.outputs})
        for region, variable in program.mode_variables().items():
            self.names.setdefault("mode" if region == CHART else region, variable)
        variables = {variable.name: variable for variable in program.variables}
        self.kinds = {name: variables[source].type for name, source in self.names.items()}
        self.units = {
            name: display_unit(variables[source].unit) for name, source in self.names.items()
        }
        self.innovations = [n for n in variables if n.startswith("innovation.")]
        observing = {info.mode for info in program.observers}
        self.observing = {m.number for m in program.modes if m.name in observing}
        self.times: list[Fraction] = []
        self.rows: list[tuple[Any, ...]] = []
        self.squares = dict.fromkeys(self.innovations, 0.0)
        self.counts = dict.fromkeys(self.innovations, 0)
        self.events: list[Event] = []
        self.mode: int | None = None

    def record(self, time: Fraction, stepper: Stepper) -> None:
        """Append the row of a tick and its transitions.

        Innovations count if the mode before the tick has an observer and the measured input is new.
        """
        self.times.append(time)
        self.rows.append(tuple([stepper.get(source) for source in self.names.values()]))
        if self.mode in self.observing:
            for name in self.innovations:
                if stepper.get(f"is_new.{name.partition('.')[2]}"):
                    self.squares[name] += stepper.get(name) ** 2
                    self.counts[name] += 1
        name, program = self.program.name, self.program
        fired = fired_by_micro_step(program, stepper)
        self.events += [
            transition_event(name, program, info, float(time), step) for step, info in fired
        ]
        self.mode = stepper.get("memory.mode")

    def innovation_rms(self) -> dict[str, float]:
        """Return the RMS innovation of each measured input that had a new value."""
        return {
            name.partition(".")[2]: math.sqrt(self.squares[name] / self.counts[name])
            for name in self.innovations
            if self.counts[name]
        }

    def trajectory(self, name: str) -> Trajectory:
        """Return the recorded rows and events as a trajectory."""
        columns = list(zip(*self.rows, strict=True))
        signals: dict[str, SignalArray] = {}
        for (key, kind), values in zip(self.kinds.items(), columns, strict=True):
            signals[key] = column_array(kind, values)
        return Trajectory(
            name=name,
            times=np.array([float(time) for time in self.times]),
            signals=signals,
            units=self.units,
            modes=mode_names(self.program),
            events=tuple(self.events),
            piecewise_constant=frozenset(wire.name for wire in self.program.outputs),
        )


def _compare_output(
    channel: Channel,
    trajectory: Trajectory,
    start: Fraction,
    program: Program,
    recording: Recording,
) -> Comparison | None:
    """Return the comparison of an output with a column; None if no value of the column is used.

    A value is compared with the output of the first tick at or after its stamp [s].
    """
    assert program.period is not None and channel.column.compare is not None
    output = trajectory.signals[channel.column.compare]
    differences = []
    for time, value in zip(channel.times, channel.values, strict=True):
        tick = math.ceil((time - start) / program.period)
        if 0 <= tick < len(output) and recording.is_used(time):
            differences.append(float(output[tick]) - value)
    if not differences:
        return None
    array = np.array(differences)
    return Comparison(
        channel.column.compare,
        float(np.sqrt(np.mean(array**2))),
        float(np.max(np.abs(array))),
        trajectory.units[channel.column.compare],
    )
