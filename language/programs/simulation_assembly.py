"""Assembly: the instances of a system with all that is between them, as one thing to compile.

What is known before a run is not in it: instants, inputs, noise (engine/batch/run_plan.py).
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
"""Part of a range's width by which a state may pass a bound unreported: what a crossing of a guard
on that bound is located within, over ten digits above the rounding of a double."""


@dataclass(frozen=True)
class InputSource:
    """What sets an input of an instance: a signal, a number, or a block of the wires.

    `is_limited`: a value that is not finite is held in the range of the input.
    """

    variable: Variable
    source: str | float
    block: str | None
    has_saturation: bool
    sensors: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecordedSignal:
    """A recorded signal, or a block of the wires."""

    name: str
    source: str
    block: str | None


@dataclass(frozen=True)
class InputTrajectory:
    """An input that changes between the instants, `delay` [s] late where it is a delayed one.

    `formulas` are the pieces that are formulas of time, by number, with their block of the wires.
    """

    name: str
    delay: Fraction
    formulas: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class SimulationAssembly:
    """Instances with their Programs, `order` of all that ticks or samples, and what they read.

    `inputs` are the system's, delayed ones among them; `controlled` are the continuous instances
    whose first inputs are those after tick 0; `slots` are the signals that rows are made of.
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
        """The continuous instances."""
        return tuple(name for name, program in self.programs.items() if program.period is None)

    @property
    def instant_actions(self) -> tuple[str, ...]:
        """What happens at an instant, by bit: ticks, samples, captures of sensors."""
        ticks = [
            name
            for name in self.order
            if name in self.programs and name not in self.continuous_instances
        ]
        late = [f"capture {name}" for name, sensor in self.sensors.items() if sensor.delay]
        return (*ticks, *self.sensors, *late)

    def digest(self) -> str:
        """Return a digest of all that is printed of it."""
        programs = [(name, digest(program)) for name, program in self.programs.items()]
        rest = (self.order, self.inputs, self.input_sources, self.row_signals, self.columns)
        more = (sorted(self.controlled), list(self.sensors.items()), digest(self.wires))
        text = repr((programs, rest, more, self.input_trajectories))
        return hashlib.sha256(text.encode()).hexdigest()

    def tunables(self) -> Iterator[tuple[str, Constant]]:
        """Yield the numbers that a variant may change, in the order of its values."""
        for name, program in self.programs.items():
            for constant in program.constants:
                if constant.kind == "tunable" and constant.type == "real" and not constant.items:
                    yield name, constant

    def first_event_numbers(self) -> dict[str, int]:
        """Return where the events of each instance begin: its transitions, then its ranges,
        then its invariants."""
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
    """Return the variables whose leaving of a range is an event: those of a continuous Program."""
    return tuple(v for v in program.variables if v.range is not None)


def output_variables(program: Program) -> dict[str, str]:
    """Return the variable that holds each output."""
    return {wire.name: wire.source for wire in program.outputs}


def input_name(source: InputSource) -> str:
    """Return the name of the input that a feed sets."""
    return unqualified_name(source.variable.name)
