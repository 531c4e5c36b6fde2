"""Compiled run: executes a single run in a compiled library.

Results are those of the interpreter bit for bit. Runs that the library cannot complete are executed
by the interpreter. Batches are in engine/batch/compiled_batch.py.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from engine.batch.build_system_program import assembly_of
from engine.batch.run_plan import build_run_plan
from engine.execution.invariant_monitor import invariant_event
from engine.execution.range_monitor import format_range_violation, range_event
from engine.execution.transition_events import mode_names, transition_event
from engine.results.row_recorder import recorded_columns
from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory, column_array, fault_names
from language.ir.number_type import round_to_type
from language.ir.program import InvariantInfo, Program, unqualified_name
from language.model.system import Scenario, System
from language.programs.system_program import SimulationAssembly, range_event_variables

EVENT_DTYPE = np.dtype(
    [
        ("time", "f8"),
        ("value", "f8"),
        ("number", "i4"),
        ("micro_step", "i4"),
        ("mode", "i4"),
        ("reserved", "i4"),
    ]
)
"""Memory layout of `Event` in codegen/templates/simulator/run.h.jinja."""
INITIAL_EVENT_CAPACITY = 1000
"""Initial number of events of a single run; the run is repeated with more if it has more."""


class RunLibrary(Protocol):
    """Compiled runs of an assembly (codegen/simulator/simulator_library.py)."""

    @property
    def columns(self) -> Sequence[int]:
        """Position of each column of the assembly in a row."""

    @property
    def width(self) -> int:
        """Number of values in a row."""

    @property
    def lanes(self) -> int:
        """Number of variants that are executed side by side."""

    def bind_plan(self, plan: Any, variants: Mapping[str, Any]) -> Callable[[int, int], None]:
        """Return a function that executes the variants from a first to before a last index."""


BuildLibrary = Callable[[SimulationAssembly], RunLibrary]
"""Function that compiles an assembly."""


class CompiledRun:
    """Compiled run that can be executed repeatedly."""

    def __init__(
        self,
        system: System,
        scenario: Scenario,
        programs: Mapping[str, Program],
        build: BuildLibrary,
    ) -> None:
        """Take a resolved scenario without planning obstacle, and compile it."""
        self.scenario = scenario
        self.assembly = assembly_of(system, scenario, programs)
        self.plan = build_run_plan(system, scenario, self.assembly)
        self.library = build(self.assembly)
        self.recorded = recorded_columns(system, scenario, programs)
        self._values = np.array(
            [round_to_type(c.value) for _, c in self.assembly.tunables()], dtype=np.float64
        )
        self._rows = np.empty((len(self.plan.rows.high), self.library.width))
        self._events = np.empty(INITIAL_EVENT_CAPACITY, dtype=EVENT_DTYPE)
        self._count = np.zeros(1, dtype=np.int64)
        self._is_left = np.zeros(1, dtype=np.uint8)
        self._faults = np.zeros(len(programs), dtype=np.uint32)
        self._call = self.library.bind_plan(self.plan, self._members())

    def run(self) -> bool:
        """Execute the run; return whether the library completed it.

        The results are in the arrays of this object.
        """
        self._call(0, 1)
        count = int(self._count[0])
        if count > len(self._events):
            self._events = np.empty(2 * count, dtype=EVENT_DTYPE)
            self._call = self.library.bind_plan(self.plan, self._members())
            self._call(0, 1)
        return not self._is_left[0]

    def trajectory(self) -> Trajectory | None:
        """Execute the run and return its trajectory; None if the interpreter has to execute it."""
        if not self.run():
            return None
        programs = self.assembly.programs
        columns = zip(self.recorded, self.library.columns, strict=True)
        return Trajectory(
            name=self.scenario.name,
            times=self.plan.rows.high.copy(),
            signals={
                column.name: column_array(column.type, self._rows[:, place].tolist())
                if column.type != "real"
                else self._rows[:, place].copy()
                for column, place in columns
            },
            units={column.name: column.unit for column in self.recorded},
            piecewise_constant=frozenset(
                column.name for column in self.recorded if column.is_piecewise_constant
            ),
            modes={
                signal: names
                for name, program in programs.items()
                for signal, names in mode_names(program, f"{name}.").items()
            },
            events=tuple(_events(self._events[: int(self._count[0])], self.assembly)),
            faults=tuple(
                fault
                for (name, program), word in zip(
                    programs.items(), self._faults.tolist(), strict=True
                )
                for fault in fault_names(name, program, word)
            ),
        )

    def _members(self) -> dict[str, Any]:
        return {
            "values": self._values,
            "tables": 0,
            "noise_strides": np.zeros(len(self.assembly.sensors) + 1, dtype=np.int64),
            "measures": 0,
            "outputs": 0,
            "most_events": len(self._events),
            "events": self._events,
            "counts": self._count,
            "is_left": self._is_left,
            "faults": self._faults,
            "rows": self._rows,
        }


def _events(found: NDArray[np.void], assembly: SimulationAssembly) -> list[Event]:
    """Return what C wrote down as events."""
    known: list[tuple[str, Program, Any]] = []
    for name, program in assembly.programs.items():
        known += [(name, program, info) for info in program.transitions]
        known += [(name, program, variable) for variable in range_event_variables(program)]
        known += [(name, program, info) for info in program.invariants]
    events = []
    for one in found.tolist():
        time, value, number, micro_step, mode, _ = one
        name, program, what = known[number]
        if hasattr(what, "slot"):
            events.append(transition_event(name, program, what, time, micro_step))
        elif isinstance(what, InvariantInfo):
            events.append(invariant_event(name, program, what, time))
        else:
            text = format_range_violation(what.name, value, *what.range)
            signal = unqualified_name(what.name)
            events.append(range_event(time, name, signal, program.mode_name(mode), text))
    return events
