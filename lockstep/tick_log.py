"""Tick log: simulates a system and records the inputs and retained variables of each instance."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

from codegen.harness.harness import (
    compared_variables,
    tick_inputs,
    tunable_constants,
)
from engine.execution.transition_events import fired_transitions
from engine.interpreter.interpreter import Stepper
from engine.results.trajectory import Trajectory
from engine.simulation.simulate import simulate
from language.ir.number_type import NumberType
from language.ir.program import Program
from language.model.system import Scenario, System

REAL_FORMAT: Mapping[NumberType, str] = {"float64": "d", "float32": "f"}
"""The format of a real in a record by its number type; all other values take 8 bytes."""


@dataclass
class TickLog:
    """The inputs and retained variables of one instance in each tick of the interpreter.

    `start` is the time [s] of tick 0. `inputs` and `values` hold one record for each tick.
    """

    program: Program
    name: str
    start: float = 0.0
    inputs: list[bytes] = field(default_factory=list)
    values: list[bytes] = field(default_factory=list)
    transitions: int = 0

    def __post_init__(self) -> None:
        """Prepare the layout of the records."""
        self._modes: tuple[int, ...] = ()
        self._input_names = tuple(variable.name for variable in tick_inputs(self.program))
        self._compared = compared_variables(self.program)
        self._names = tuple(item.name for item in self._compared)
        real = REAL_FORMAT[self.program.number_type]
        kinds = [real if item.kind == "real" else "q" for item in self._compared]
        self._input = struct.Struct(f"<{len(self._input_names) + 1}d")
        self._tunable_names = tuple(constant.name for constant in tunable_constants(self.program))
        self._page = [constant.value for constant in tunable_constants(self.program)]
        self._page_record = struct.Struct(f"<{len(self._page)}d")
        self._value = struct.Struct(f"<{''.join(kinds)}")
        ends = [0, *itertools.accumulate(struct.calcsize(f"<{kind}") for kind in kinds)]
        self._slices = [slice(*ends[k : k + 2]) for k in range(len(kinds))]

    def record_tick(self, stepper: Stepper) -> None:
        """Append the inputs and values after a tick, and count its transitions.

        A record of inputs ends with 0.0, or with 1.0 and the real tunable scalars if one of them
        has changed since the last tick (at first: since the default).
        """
        inputs = [float(stepper.get(name)) for name in self._input_names]
        page = [stepper.get(name) for name in self._tunable_names]
        record = self._input.pack(*inputs, float(page != self._page))
        if page != self._page:
            record += self._page_record.pack(*page)
            self._page = page
        self.inputs.append(record)
        self.values.append(self._value.pack(*[stepper.get(n) for n in self._names]))
        self.transitions += self._count_transitions(stepper)

    def _count_transitions(self, stepper: Stepper) -> int:
        """Return the number of transitions that fired in a tick.

        For a continuous automaton it is 1 if a mode changed in the major step, else 0.
        """
        if self.program.period is not None:
            return len(fired_transitions(self.program, stepper))
        before = self._modes
        self._modes = tuple(stepper.get(name) for name in self.program.mode_variables().values())
        return int(before not in ((), self._modes))

    def unpack(self, record: bytes) -> tuple[float | int, ...]:
        """Return the values of a record of `values`, in the order of `names`.

        A real is a float, any other value an integer.
        """
        return self._value.unpack(record)

    def value_bytes(self, record: bytes, position: int) -> bytes:
        """Return the bytes of one value of a record, in little-endian order.

        `record` is one of `values`, `position` an index of `names`.
        """
        return record[self._slices[position]]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the values of a record: those of `compared_variables`."""
        return self._names

    @property
    def record_size(self) -> int:
        """The size of a record of values [bytes]."""
        return self._value.size


def record_ticks(system: System, scenario: Scenario) -> tuple[Trajectory, dict[str, TickLog]]:
    """Simulate a scenario; return the trajectory and the tick log of each instance by name.

    Logs are in the order of the first ticks; an instance that executed no tick has none. A log
    starts at the offset of its instance.
    """
    logs: dict[str, TickLog] = {}

    def ticked(name: str, used: Program, stepper: Stepper) -> None:
        if name not in logs:
            logs[name] = TickLog(used, name=name, start=float(system.instances[name].offset))
        logs[name].record_tick(stepper)

    return simulate(system, scenario, on_tick=ticked), logs
