"""Simulate: a system through a scenario - continuous flow, events, ticks, one instant at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

from engine.continuous import ContinuousRun, Stopped
from engine.feeding import Feeding, where
from engine.firing import event, fired_in_steps, mode_names
from engine.interpreter import Interpreter, Stepper
from engine.invariant_watch import InvariantWatch
from engine.page import calibrate
from engine.range_watch import left_range
from engine.rows import Rows, recorded
from engine.schedule import Schedule
from engine.signals import Signals
from engine.starting import programs_of
from engine.stimulus import resolved
from engine.surroundings import Surroundings
from engine.trajectory import Event, Trajectory, fault_names
from language.experiment import Scenario, System
from language.program import Program

Build = Callable[[Program], Stepper]
Ticked = Callable[[str, Program, Stepper], None]
CONVERT: Mapping[str, Callable[[Any], Any]] = {"real": float, "truth": bool, "whole": int}
"""What an input of a type makes of a number."""


def simulate(
    system: System,
    scenario: Scenario,
    build: Build = Interpreter,
    ticked: Ticked | None = None,
    programs: Mapping[str, Program] | None = None,
) -> Trajectory:
    """Return the trajectory of a system through a scenario.

    `build` makes the steppers (the interpreter, or a compiled one with the same protocol);
    `ticked` is called after each tick of a sampled instance, and after each major step of a
    continuous one until something outside happens between two of them; `programs` are those of the
    instances where they are made already. Raises SpecError for what is wrong with a recording.
    """
    return _Simulation(system, resolved(system, scenario), build, ticked, programs).run()


class _Simulation:
    """The instances of a system and the instants at which something happens."""

    def __init__(
        self,
        system: System,
        scenario: Scenario,
        build: Build,
        ticked: Ticked | None,
        programs: Mapping[str, Program] | None,
    ) -> None:
        self.system = system
        self.scenario = scenario
        self.ticked = ticked
        self.programs = dict(programs or programs_of(system, scenario))
        self.schedule = Schedule(system, scenario, self.programs)
        self.steppers = {name: build(program) for name, program in self.programs.items()}
        self.signals = Signals(system, scenario, self.programs, self.steppers)
        self.rows = Rows(recorded(system, scenario, self.programs))
        self.events: list[Event] = []
        self.feeding = Feeding(system, self.programs, self.steppers, self.signals)
        self.left: set[tuple[str, str]] = set()
        self.invariants = {
            name: InvariantWatch(name, program, self.steppers[name], self.events.append)
            for name, program in self.programs.items()
        }
        self.words: dict[str, int] = {}
        self.around: dict[str, Surroundings] = {}
        self.flows: dict[str, ContinuousRun] = {}
        for name, program in self.programs.items():
            if program.period is None:
                self._add_flow(name, program)

    def _add_flow(self, name: str, program: Program) -> None:
        stepper, log = self.steppers[name], self.events.append
        around = Surroundings(name, stepper, self.signals, self.feeding.wires[name], program)
        self.around[name] = around
        self.flows[name] = ContinuousRun(name, program, stepper, log, around)
        if self.ticked:
            self.flows[name].stepped = partial(self._stepped, name)

    def _stepped(self, name: str) -> None:
        has_step = "step" in self.programs[name].blocks
        if self.ticked and has_step and self.flows[name].off_step is None:
            self.ticked(name, self.programs[name], self.steppers[name])

    def run(self) -> Trajectory:
        """Run to the horizon, or until something stops the run: what was done is kept."""
        stopped = None
        rows = iter(self.schedule.rows)
        row = next(rows)
        try:
            self._start()
            for time in self.schedule.instants():
                between = []
                while row < time:
                    between.append(row)
                    row = next(rows)
                self._flow_to(time, between)
                self._instant(time)
                if row == time:
                    self.rows.add(time, self.signals.now, self.signals.formula)
                    row = next(rows)
        except Stopped as reason:
            stopped = str(reason)
        return self._trajectory(stopped)

    def _start(self) -> None:
        for name, program in self.programs.items():
            stepper = self.steppers[name]
            for variable in program.inputs:
                stepper.set(variable.name, CONVERT[variable.type](0.0))
            for key, default in program.defaults.items():
                stepper.set(f"input.{key}", default)
            for variable in program.variables:
                if variable.name.startswith("is_new."):
                    stepper.set(variable.name, True)
        for line in self.signals.lines.values():
            if line.course is None:
                line.put(Fraction(0), self.signals.now(line.line.source))
        for name, flow in self.flows.items():
            self.feeding.feed(name, Fraction(0))
            flow.start()

    def _flow_to(self, time: Fraction, between: Sequence[Fraction]) -> None:
        """Flow all continuous instances up to an instant, and keep the rows before it."""
        try:
            for flow in self.flows.values():
                flow.flow_to(time, between)
        finally:
            self._keep(between)

    def _keep(self, between: Sequence[Fraction]) -> None:
        """Keep the rows that every continuous instance has reached."""
        arounds = list(self.around.values())
        reached = min((len(around.looked) for around in arounds), default=len(between))
        picked = self.rows.picked_from(arounds[0].names) if len(arounds) == 1 else None
        if picked:
            self.rows.extend(between[:reached], map(picked, arounds[0].looked))
            reached = 0
        for number, row in enumerate(between[:reached]):
            found: dict[str, Any] = {}
            for around in arounds:
                found.update(zip(around.names, around.looked[number], strict=True))
            self.rows.add(row, partial(self._seen_at, row, found), self.signals.formula)
        for around in arounds:
            around.looked.clear()

    def _seen_at(self, row: Fraction, found: Mapping[str, Any], name: str) -> Any:
        return found[name] if name in found else self.signals.at(row, row)(name)

    def _instant(self, time: Fraction) -> None:
        """Flow has ended: inputs take their new values, then jumps, then ticks in their order."""
        self.signals.read_inputs(time)
        self._turn_pages(time, continuous=False)
        for name in self.flows:
            if time > 0 or not self._is_controlled(name):
                self._update_flow(name, time)
        if time == 0:
            for run in self.signals.sensors.values():
                run.start(self.signals.now(run.sensor.source))
        for name in self.system.order:
            if name in self.schedule.samples and self.schedule.samples[name].has(time):
                self._sample(name, time)
            elif name in self.schedule.ticks and self.schedule.ticks[name].has(time):
                self._tick(name, time)
        for name in self.flows:
            self._update_flow(name, time)
        for flow in self.flows.values():
            flow.end_step()
        self._turn_pages(time, continuous=True)
        for name in self.schedule.captured(time):
            self._capture(name, time)

    def _turn_pages(self, time: Fraction, continuous: bool) -> None:
        """A new calibration holds from this tick or, if continuous, from the next step on."""
        for page in self.scenario.pages:
            if page.time == time:
                for name, program in self.programs.items():
                    values = {p: v for (owner, p), v in page.values.items() if owner == name}
                    if (program.period is None) == continuous:
                        calibrate(self.steppers[name], program, values)

    def _sample(self, name: str, time: Fraction) -> None:
        run = self.signals.sensors[name]
        run.sample(time, self.signals.now(run.sensor.source))
        self._put_into_lines([name], time)

    def _capture(self, name: str, time: Fraction) -> None:
        """Keep a signal that arrives later, as it is when everything at an instant has happened."""
        if name in self.signals.sensors:
            run = self.signals.sensors[name]
            run.capture(time, self.signals.now(run.sensor.source))
        else:
            line = self.signals.lines[name]
            line.put(time, self.signals.now(line.line.source))

    def _put_into_lines(self, sources: Sequence[str], time: Fraction) -> None:
        for line in self.signals.lines.values():
            if line.line.source in sources:
                line.put(time, self.signals.now(line.line.source))

    def _update_flow(self, name: str, time: Fraction) -> None:
        """An input that changed is an event: guards are read again (rule 11)."""
        changed, flow = self.feeding.feed(name, time), self.flows[name]
        if changed and time == 0:
            flow.start()
        if changed or not flow.is_settled:
            flow.settle()
        else:
            self.steppers[name].run("equations")

    def _is_controlled(self, name: str) -> bool:
        """Tell whether an input reads a sampled instance: its first value is that of tick 0."""
        reads = [read for connection in self.feeding.wires[name] for read in connection.reads]
        return any(read.partition(".")[0] in self.programs for read in reads)

    def _tick(self, name: str, time: Fraction) -> None:
        stepper, program = self.steppers[name], self.programs[name]
        sources = [f"{name}.{wire.name}" for wire in program.outputs]
        self.feeding.feed(name, time)
        self.feeding.flag_new(name, self.schedule.samples)
        self._move_lags(sources, time)
        stepper.run("step")
        self._move_lags(sources, time)
        self._put_into_lines(sources, time)
        taken = fired_in_steps(program, stepper)
        self.events += [event(name, program, info, float(time), step) for step, info in taken]
        self._note_ranges(name, time)
        self.invariants[name].look(time)
        if self.ticked:
            self.ticked(name, program, stepper)
        self._require_finite(name, time)

    def _note_ranges(self, name: str, time: Fraction) -> None:
        """Report each signal that was held in its range once, with time and mode (rule 18)."""
        stepper, program = self.steppers[name], self.programs[name]
        self.words[name] = self.words.get(name, 0) | stepper.get("memory.faults")
        for signal in stepper.left():
            if (name, signal) not in self.left:
                self.left.add((name, signal))
                mode = program.mode_name(stepper.get("memory.mode"))
                text = f"`{signal}` was held in its range"
                self.events.append(left_range(float(time), name, signal, mode, text))

    def _move_lags(self, sources: Sequence[str], time: Fraction) -> None:
        for run in self.signals.sensors.values():
            if run.sensor.lag and run.sensor.source in sources:
                run.lag.move(time, self.signals.now(run.sensor.source))

    def _require_finite(self, name: str, time: Fraction) -> None:
        stepper, program = self.steppers[name], self.programs[name]
        for wire in program.outputs:
            value = stepper.get(wire.source)
            if isinstance(value, float) and not math.isfinite(value):
                raise Stopped(
                    f"{where(name, program, stepper, time)}: output `{wire.name}` is {value}"
                )

    def _trajectory(self, stopped: str | None) -> Trajectory:
        return Trajectory(
            name=self.scenario.name,
            times=self.rows.seconds(),
            signals=self.rows.signals(),
            units=self.rows.units(),
            modes={
                signal: names
                for name, program in self.programs.items()
                for signal, names in mode_names(program, f"{name}.").items()
            },
            events=tuple(self.events),
            stopped=stopped,
            faults=tuple(
                fault
                for name, program in self.programs.items()
                if program.faults
                for fault in fault_names(name, program, self.words.get(name, 0))
            ),
        )
