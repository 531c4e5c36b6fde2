"""Assembly of a system for compilation: the Programs of its instances and their connections.

Instants, inputs and noise of a run are not part of it (engine/batch/run_plan.py).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.ir.printer import digest
from language.ir.program import Constant, Program, Variable, unqualified_name
from language.model.system import Sensor

RANGE_TOLERANCE = 1e-9
"""The part of a range's width by which a state may pass a bound without an event (rule 18c).

A crossing of a guard at that bound is located within it, and it is more than ten digits above the
rounding of a double.
"""


@dataclass(frozen=True)
class InputSource:
    """The source of an input of an instance: a signal, a number or a block of the wires Program.

    `has_saturation` tells whether a value that is not finite is held in the range of the input.
    `sensors` are the sensors whose samples the input depends on.
    """

    variable: Variable
    source: str | float
    block: str | None
    has_saturation: bool
    sensors: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecordedSignal:
    """A column of the recording: a signal or the value of a block of the wires Program."""

    name: str
    source: str
    block: str | None


@dataclass(frozen=True)
class InputTrajectory:
    """An input that changes between instants; `delay` [s] is that of a delayed input.

    `formulas` are the pieces that are formulas of time, as pairs of number and block of the wires.
    """

    name: str
    delay: Fraction
    formulas: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class SimulationAssembly:
    """The instances of a system with their Programs, connections, sensors and recorded columns.

    `order` is the order of all instances and sensors that act at instants. `inputs` are those of
    the system, delayed ones included. `row_signals` are the signals from which rows are computed.
    `controlled` are the continuous instances whose first inputs are those after tick 0.
    """

    programs: Mapping[str, Program]
    order: tuple[str, ...]
    inputs: tuple[str, ...]
    input_sources: Mapping[str, tuple[InputSource, ...]]
    sensors: Mapping[str, Sensor]
    wires: Program
    row_signals: tuple[str, ...]
    columns: tuple[RecordedSignal, ...]
    controlled: frozenset[str]
    input_trajectories: tuple[InputTrajectory, ...] = ()

    @property
    def continuous_instances(self) -> tuple[str, ...]:
        """The names of the continuous instances, in the order of `programs`."""
        return tuple(name for name, program in self.programs.items() if program.period is None)

    @property
    def instant_actions(self) -> tuple[str, ...]:
        """The actions at an instant, by bit: ticks, sensor samples, captures of delayed sensors.

        They are the names of sampled instances in `order`, then of all sensors, then `capture
        <sensor>` of each sensor with a delay.
        """
        ticks = [
            name
            for name in self.order
            if name in self.programs and name not in self.continuous_instances
        ]
        late = [f"capture {name}" for name, sensor in self.sensors.items() if sensor.delay]
        return (*ticks, *self.sensors, *late)

    def digest(self) -> str:
        """Return the SHA-256 digest (hexadecimal) of all that determines the printed code."""
        programs = [(name, digest(program)) for name, program in self.programs.items()]
        rest = (self.order, self.inputs, self.input_sources, self.row_signals, self.columns)
        more = (sorted(self.controlled), list(self.sensors.items()), digest(self.wires))
        text = repr((programs, rest, more, self.input_trajectories))
        return hashlib.sha256(text.encode()).hexdigest()

    def tunables(self) -> Iterator[tuple[str, Constant]]:
        """Yield the instance and the constant of each real tunable parameter that is no table.

        Instances and constants are in the order of `programs` and of their Programs.
        """
        for name, program in self.programs.items():
            for constant in program.constants:
                if constant.kind == "tunable" and constant.type == "real" and not constant.items:
                    yield name, constant

    def first_event_numbers(self) -> dict[str, int]:
        """Return the number of the first event of each instance, from 0 without gaps.

        The events of an instance are its transitions, then its ranges, then its invariants.
        """
        found, count = {}, 0
        for name, program in self.programs.items():
            found[name] = count
            count += (
                len(program.transitions)
                + len(range_event_variables(program))
                + len(program.invariants)
            )
        return found


def range_event_variables(program: Program) -> tuple[Variable, ...]:
    """Return the variables with a range whose violation is an event (rule 18c)."""
    return tuple(v for v in program.variables if v.range is not None)


def output_variables(program: Program) -> dict[str, str]:
    """Return the variable of each output by the name of the output."""
    return {wire.name: wire.source for wire in program.outputs}


def input_name(source: InputSource) -> str:
    """Return the name of the input that a source sets, without its group."""
    return unqualified_name(source.variable.name)
