"""Simulate: a system through a scenario - continuous flow, events, ticks, one instant at a time."""

from __future__ import annotations

import dataclasses
import heapq
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from engine.continuous import ContinuousRun, Stopped
from engine.interpreter import Interpreter, Stepper
from engine.trajectory import Event, Trajectory, column_array, fault_names
from language.load import program_of
from language.model import CHART, Automaton, Formula, Scenario, Stimulus, System
from language.problem import Problems, Source, Span, SpecError
from language.program import Program
from language.syntax import Number
from language.units import NO_UNIT

Build = Callable[[Program], Stepper]
Ticked = Callable[[str, Program, Stepper], None]
MAX_INSTANTS = 100_000_000
"""Most ticks and rows of one run: about an hour of the interpreter."""


def simulate(
    system: System, scenario: Scenario, build: Build = Interpreter, ticked: Ticked | None = None
) -> Trajectory:
    """Return the trajectory of a system through a scenario.

    `build` makes the steppers (the interpreter, or a compiled one with the same protocol);
    `ticked` is called after each tick of a sampled instance.
    """
    return _Simulation(system, scenario, build, ticked).run()


def programs_of(system: System, scenario: Scenario) -> dict[str, Program]:
    """Return the Program of each instance, with the scenario's start values."""
    found = {}
    for name, instance in system.instances.items():
        start = {
            key.partition(".")[2]: value
            for key, value in scenario.initial.items()
            if key.partition(".")[0] == name
        }
        found[name] = program_of(_started(instance.automaton, start))
    return found


def _started(automaton: Automaton, start: Mapping[str, Fraction]) -> Automaton:
    states = dict(automaton.states)
    nowhere = Span(Source("scenario"), 1, 1)
    for name, value in start.items():
        formula = Formula(Number(value, NO_UNIT, nowhere), f"states.{name}.initial")
        states[name] = dataclasses.replace(states[name], initial=formula)
    return dataclasses.replace(automaton, states=states)


class _Simulation:
    """The instances of a system and the instants at which something happens."""

    def __init__(
        self, system: System, scenario: Scenario, build: Build, ticked: Ticked | None
    ) -> None:
        self.system = system
        self.scenario = scenario
        self.ticked = ticked
        self.programs = programs_of(system, scenario)
        self.steppers = {name: build(program) for name, program in self.programs.items()}
        self.events: list[Event] = []
        self.flows = {
            name: ContinuousRun(name, program, self.steppers[name], self.events.append)
            for name, program in self.programs.items()
            if program.period is None
        }
        self.ticks = dict.fromkeys(self.programs, 0)
        self.inputs = {name: 0.0 for name in system.inputs}
        self.wires = self._wires()
        self.columns = {
            f"{name}.{wire.name}": (name, wire)
            for name, program in self.programs.items()
            for wire in program.outputs
        }
        self.rows: list[tuple[Any, ...]] = []
        self.times: list[Fraction] = []

    def run(self) -> Trajectory:
        stopped = None
        try:
            self._start()
            for time in self._instants():
                self._instant(time)
        except Stopped as reason:
            stopped = str(reason)
        return self._trajectory(stopped)

    def _wires(self) -> dict[str, list[tuple[str, str | float]]]:
        """Per instance: its inputs and what they read."""
        found: dict[str, list[tuple[str, str | float]]] = {name: [] for name in self.programs}
        for (owner, name), connection in self.system.connections.items():
            source = connection.source
            value = float(source) if isinstance(source, Fraction) else source
            found[owner].append((f"input.{name}", value))
        for owner, program in self.programs.items():
            connected = {name for name, _ in found[owner]}
            for name, default in program.defaults.items():
                if f"input.{name}" not in connected:
                    found[owner].append((f"input.{name}", default))
        return found

    def _start(self) -> None:
        for name, program in self.programs.items():
            for variable in program.inputs:
                self.steppers[name].set(variable.name, 0.0)
            for variable in program.variables:
                if variable.name.startswith("is_new."):
                    self.steppers[name].set(variable.name, True)
        self._read_inputs(Fraction(0))
        for name, flow in self.flows.items():
            self._feed(name)
            flow.start()

    def _instants(self) -> Iterator[Fraction]:
        """Yield every instant at which an input steps, an instance ticks or a row is kept."""
        horizon = self.scenario.horizon
        steps = {time for s in self.scenario.inputs.values() for time, _ in s.steps}
        grids = [(Fraction(0), self.scenario.every)]
        for name, program in self.programs.items():
            if program.period is not None:
                grids.append((self.system.instances[name].offset, program.period))
        count = sum(max(0, int((horizon - start) // period) + 1) for start, period in grids)
        if count > MAX_INSTANTS:
            label = f"the scenario has {count} ticks and rows; at most {MAX_INSTANTS} are run"
            problems = Problems()
            problems.error("range", self.scenario.span, label, "a shorter `horizon`")
            raise SpecError(problems.found)
        last = None
        for time in heapq.merge(sorted(steps), *(_grid(*grid) for grid in grids)):
            if time > horizon:
                return
            if time != last:
                yield time
            last = time

    def _instant(self, time: Fraction) -> None:
        for flow in self.flows.values():
            flow.flow_to(time)
        self._read_inputs(time)
        for name in self.flows:
            if time > 0 or not self._is_controlled(name):
                self._update_flow(name, time)
        for name in self.system.order:
            if self._ticks_at(name, time):
                self._tick(name, time)
        for name in self.flows:
            self._update_flow(name, time)
        if time % self.scenario.every == 0:
            self.times.append(time)
            self.rows.append(
                tuple(self._value(name, wire.source) for name, wire in self.columns.values())
            )

    def _read_inputs(self, time: Fraction) -> None:
        for name, stimulus in self.scenario.inputs.items():
            self.inputs[name] = _at(stimulus, time)

    def _feed(self, name: str) -> bool:
        """Set the inputs of an instance; tell whether one changed."""
        stepper, changed = self.steppers[name], False
        for target, source in self.wires[name]:
            value = self._source(source)
            if stepper.get(target) != value:
                stepper.set(target, value)
                changed = True
        return changed

    def _source(self, source: str | float) -> Any:
        if not isinstance(source, str):
            return source
        if source in self.inputs:
            return self.inputs[source]
        owner, wire = self.columns[source]
        return self._value(owner, wire.source)

    def _value(self, owner: str, variable: str) -> Any:
        return self.steppers[owner].get(variable)

    def _update_flow(self, name: str, time: Fraction) -> None:
        """An input that changed is an event: guards are read again (rule 11)."""
        changed, flow = self._feed(name), self.flows[name]
        if changed and time == 0:
            flow.start()
        if changed or not flow.is_settled:
            flow.settle()
        else:
            self.steppers[name].run("equations")

    def _is_controlled(self, name: str) -> bool:
        """Tell whether an input reads a sampled instance: its first value is that of tick 0."""
        sources = [source for _, source in self.wires[name] if isinstance(source, str)]
        return any(source in self.columns for source in sources)

    def _ticks_at(self, name: str, time: Fraction) -> bool:
        period = self.programs[name].period
        if period is None:
            return False
        since = time - self.system.instances[name].offset
        return since >= 0 and since % period == 0

    def _tick(self, name: str, time: Fraction) -> None:
        stepper, program = self.steppers[name], self.programs[name]
        self._feed(name)
        stepper.run("step")
        for variable in program.fired_variables():
            fired = stepper.get(variable)
            if fired:
                info = program.transitions[fired - 1]
                modes = [program.mode_name(n, info.region) for n in (info.source, info.target)]
                self.events.append(
                    Event(float(time), 0, name, info.name, modes[0], modes[1], info.region)
                )
        self.ticks[name] += 1
        if self.ticked:
            self.ticked(name, program, stepper)
        self._require_finite(name, time)

    def _require_finite(self, name: str, time: Fraction) -> None:
        stepper = self.steppers[name]
        for wire in self.programs[name].outputs:
            value = stepper.get(wire.source)
            if isinstance(value, float) and not math.isfinite(value):
                mode = self.programs[name].mode_name(stepper.get("memory.mode"))
                where = f"t = {float(time):.9g} s, `{name}` in mode `{mode}`"
                raise Stopped(f"{where}: output `{wire.name}` is {value}")

    def _trajectory(self, stopped: str | None) -> Trajectory:
        columns = list(zip(*self.rows, strict=True)) if self.rows else [()] * len(self.columns)
        signals = {}
        for (key, (_, wire)), values in zip(self.columns.items(), columns, strict=True):
            signals[key] = column_array(wire.type, values)
        return Trajectory(
            name=self.scenario.name,
            times=np.array([float(time) for time in self.times]),
            signals=signals,
            units={key: wire.unit for key, (_, wire) in self.columns.items()},
            modes={
                f"{name}.{'mode' if region == CHART else region}": {
                    mode.number: mode.name for mode in program.modes_of(region)
                }
                for name, program in self.programs.items()
                for region in program.mode_variables()
            },
            events=tuple(self.events),
            stopped=stopped,
            faults=tuple(
                fault
                for name, program in self.programs.items()
                if program.faults
                for fault in fault_names(name, program, self.steppers[name].get("memory.faults"))
            ),
        )


def _at(stimulus: Stimulus, time: Fraction) -> float:
    """Return the value of a right-continuous step function."""
    value = stimulus.steps[0][1]
    for start, later in stimulus.steps:
        if start <= time:
            value = later
    return value.numerator / value.denominator


def _grid(start: Fraction, period: Fraction) -> Iterator[Fraction]:
    """Yield start, start + period, start + 2 periods ... exactly."""
    return (start + k * period for k in itertools.count())
