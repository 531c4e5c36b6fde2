"""Simulation: executes a system through a scenario, instant by instant.

Between instants the continuous instances flow. At an instant, inputs take their new values, enabled
transitions fire, and sampled instances and sensors execute in the order of the system (rule 11a).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

from engine.execution.event_loop import ContinuousRun, SimulationStopped
from engine.execution.invariant_monitor import InvariantMonitor
from engine.execution.range_monitor import range_event
from engine.execution.transition_events import fired_by_micro_step, mode_names, transition_event
from engine.interpreter.apply_calibration import calibrate
from engine.interpreter.interpreter import Interpreter, Stepper
from engine.results.row_recorder import RowRecorder, recorded_columns
from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory, fault_names
from engine.simulation.event_schedule import Schedule
from engine.simulation.input_connections import InputWiring, describe_instant
from engine.simulation.instance_programs import programs_of
from engine.simulation.signal_values import Signals
from engine.simulation.stimuli import resolve_recording
from engine.simulation.system_environment import SystemEnvironment
from language.ir.program import Program
from language.model.system import Scenario, System

BuildStepper = Callable[[Program], Stepper]
"""Function that creates the stepper of a Program."""
TickCallback = Callable[[str, Program, Stepper], None]
"""Function that is called with the name, Program and stepper of an instance after a tick."""
CONVERTER_OF_TYPE: Mapping[str, Callable[[Any], Any]] = {"real": float, "truth": bool, "whole": int}
"""Conversion of a number to the value of an input, by type."""


def simulate(
    system: System,
    scenario: Scenario,
    build: BuildStepper = Interpreter,
    on_tick: TickCallback | None = None,
    programs: Mapping[str, Program] | None = None,
) -> Trajectory:
    """Return the trajectory of a system through a scenario.

    `build` creates the steppers: the interpreter, or an executor with the same protocol. `on_tick`
    is called after each tick of a sampled instance, and after each major step of a continuous
    instance that has a block `step`, until an instant lies between two major steps. `programs` are
    the Programs of the instances if they exist already. A run that stops early has its results
    until then and the reason in `stopped`. Raises SpecError for mistakes in a recording and for too
    many instants.
    """
    return _Simulation(system, resolve_recording(scenario), build, on_tick, programs).run()


class _Simulation:
    """State of a simulation: steppers, signals, schedule and recorded results."""

    def __init__(
        self,
        system: System,
        scenario: Scenario,
        build: BuildStepper,
        on_tick: TickCallback | None,
        programs: Mapping[str, Program] | None,
    ) -> None:
        self.system = system
        self.scenario = scenario
        self.on_tick = on_tick
        self.programs = dict(programs or programs_of(system, scenario))
        self.schedule = Schedule(system, scenario, self.programs)
        self.steppers = {name: build(program) for name, program in self.programs.items()}
        self.signals = Signals(system, scenario, self.programs, self.steppers)
        self.rows = RowRecorder(recorded_columns(system, scenario, self.programs))
        self.events: list[Event] = []
        self.wiring = InputWiring(system, self.programs, self.steppers, self.signals)
        self.reported_ranges: set[tuple[str, str]] = set()
        self.invariants = {
            name: InvariantMonitor(name, program, self.steppers[name], self.events.append)
            for name, program in self.programs.items()
        }
        self.fault_words: dict[str, int] = {}
        self.fault_instants: dict[str, str] = {}
        self.environments: dict[str, SystemEnvironment] = {}
        self.flows: dict[str, ContinuousRun] = {}
        for name, program in self.programs.items():
            if program.period is None:
                self._add_continuous_run(name, program)

    def _add_continuous_run(self, name: str, program: Program) -> None:
        """Create the environment and the event loop of a continuous instance."""
        stepper, log = self.steppers[name], self.events.append
        wires = self.wiring.wires[name]
        environment = SystemEnvironment(name, stepper, self.signals, wires, program)
        self.environments[name] = environment
        self.flows[name] = ContinuousRun(name, program, stepper, log, environment)
        if self.on_tick:
            self.flows[name].on_step = partial(self._report_step, name)

    def _report_step(self, name: str) -> None:
        """Call `on_tick` after a major step, unless an instant was between two major steps."""
        has_step = "step" in self.programs[name].blocks
        if self.on_tick and has_step and self.flows[name].off_step is None:
            self.on_tick(name, self.programs[name], self.steppers[name])

    def run(self) -> Trajectory:
        """Run to the horizon and return the trajectory.

        If the simulation stops earlier, the trajectory has all results until then and the reason.
        """
        stopped = None
        rows = iter(self.schedule.rows)
        row = next(rows)
        try:
            self._start()
            for time in self.schedule.instants():
                row_times = []
                while row < time:
                    row_times.append(row)
                    row = next(rows)
                self._flow_to(time, row_times)
                self._process_instant(time)
                if row == time:
                    self.rows.add(time, self.signals.current_value, self.signals.evaluate_formula)
                    row = next(rows)
        except SimulationStopped as reason:
            stopped = str(reason)
        return self._build_trajectory(stopped)

    def _start(self) -> None:
        """Set inputs, defaults and delayed signals, and start the continuous instances."""
        for name, program in self.programs.items():
            stepper = self.steppers[name]
            for variable in program.inputs:
                stepper.set(variable.name, CONVERTER_OF_TYPE[variable.type](0.0))
            for key, default in program.defaults.items():
                stepper.set(f"input.{key}", default)
            for variable in program.variables:
                if variable.name.startswith("is_new."):
                    stepper.set(variable.name, True)
        for line in self.signals.delay_lines.values():
            if line.input_signal is None:
                line.push(Fraction(0), self.signals.current_value(line.delayed_signal.source))
        for name, flow in self.flows.items():
            self.wiring.set_inputs(name, Fraction(0))
            flow.start()

    def _flow_to(self, time: Fraction, row_times: Sequence[Fraction]) -> None:
        """Advance all continuous instances to an instant [s] and record the rows before it."""
        try:
            for flow in self.flows.values():
                flow.flow_to(time, row_times)
        finally:
            self._record_rows(row_times)

    def _record_rows(self, row_times: Sequence[Fraction]) -> None:
        """Record the rows that every continuous instance has reached."""
        environments = list(self.environments.values())
        reached = min((len(each.sampled_rows) for each in environments), default=len(row_times))
        pick_row = (
            self.rows.make_row_picker(environments[0].names) if len(environments) == 1 else None
        )
        if pick_row:
            self.rows.extend(row_times[:reached], map(pick_row, environments[0].sampled_rows))
            reached = 0
        for number, row in enumerate(row_times[:reached]):
            values: dict[str, Any] = {}
            for environment in environments:
                values.update(zip(environment.names, environment.sampled_rows[number], strict=True))
            self.rows.add(
                row, partial(self._value_at_row, row, values), self.signals.evaluate_formula
            )
        for environment in environments:
            environment.sampled_rows.clear()

    def _value_at_row(self, row: Fraction, values: Mapping[str, Any], name: str) -> Any:
        """Return a signal at a row [s]: the sampled value, else the value of its source then."""
        return values[name] if name in values else self.signals.reader_at(row, row)(name)

    def _process_instant(self, time: Fraction) -> None:
        """Execute an instant [s]: inputs, jumps, then samples and ticks in order, then jumps again.

        New calibrations of sampled instances apply before, those of continuous instances after.
        Delayed signals are captured last.
        """
        self.signals.read_inputs(time)
        self._apply_calibrations(time, continuous=False)
        for name in self.flows:
            if time > 0 or not self._reads_sampled_instance(name):
                self._update_flow(name, time)
        if time == 0:
            for run in self.signals.sensors.values():
                run.start(self.signals.current_value(run.sensor.source))
        for name in self.system.order:
            if name in self.schedule.samples and self.schedule.samples[name].has(time):
                self._sample(name, time)
            elif name in self.schedule.ticks and self.schedule.ticks[name].has(time):
                self._tick(name, time)
        for name in self.flows:
            self._update_flow(name, time)
        for flow in self.flows.values():
            flow.end_step()
        self._apply_calibrations(time, continuous=True)
        for name in self.schedule.captures_at(time):
            self._capture(name, time)

    def _apply_calibrations(self, time: Fraction, continuous: bool) -> None:
        """Apply the calibrations of an instant to the continuous or to the sampled instances.

        They are in effect from this tick or, if continuous, from the next step on.
        """
        for page in self.scenario.calibrations:
            if page.time == time:
                for name, program in self.programs.items():
                    values = {p: v for (owner, p), v in page.values.items() if owner == name}
                    if (program.period is None) == continuous:
                        calibrate(self.steppers[name], program, values)

    def _sample(self, name: str, time: Fraction) -> None:
        """Sample a sensor and store the value in its delay lines."""
        run = self.signals.sensors[name]
        run.sample(time, self.signals.current_value(run.sensor.source))
        self._push_to_lines([name], time)

    def _capture(self, name: str, time: Fraction) -> None:
        """Capture the source of a delayed sensor or signal after all else at an instant."""
        if name in self.signals.sensors:
            run = self.signals.sensors[name]
            run.capture(time, self.signals.current_value(run.sensor.source))
        else:
            line = self.signals.delay_lines[name]
            line.push(time, self.signals.current_value(line.delayed_signal.source))

    def _push_to_lines(self, sources: Sequence[str], time: Fraction) -> None:
        """Store the present values of some sources in their delay lines."""
        for line in self.signals.delay_lines.values():
            if line.delayed_signal.source in sources:
                line.push(time, self.signals.current_value(line.delayed_signal.source))

    def _update_flow(self, name: str, time: Fraction) -> None:
        """Set the inputs of a continuous instance; a change is an event (rule 11a).

        If an input changed or the instance is not settled, enabled transitions fire; otherwise the
        equations are evaluated.
        """
        changed, flow = self.wiring.set_inputs(name, time), self.flows[name]
        if changed and time == 0:
            flow.start()
        if changed or not flow.is_settled:
            flow.settle()
        else:
            self.steppers[name].run("equations")

    def _reads_sampled_instance(self, name: str) -> bool:
        """Return whether an input of an instance reads another instance.

        Its first value is then that of tick 0.
        """
        reads = [read for connection in self.wiring.wires[name] for read in connection.reads]
        return any(read.partition(".")[0] in self.programs for read in reads)

    def _tick(self, name: str, time: Fraction) -> None:
        """Execute a tick of a sampled instance and record its events.

        Lags of sensors on its outputs are advanced before and after. Raises SimulationStopped if an
        output is not finite.
        """
        stepper, program = self.steppers[name], self.programs[name]
        sources = [f"{name}.{wire.name}" for wire in program.outputs]
        self.wiring.set_inputs(name, time)
        self.wiring.flag_new_inputs(name, self.schedule.samples)
        self._advance_lags(sources, time)
        stepper.run("step")
        self._advance_lags(sources, time)
        self._push_to_lines(sources, time)
        fired = fired_by_micro_step(program, stepper)
        self.events += [
            transition_event(name, program, info, float(time), step) for step, info in fired
        ]
        self._report_range_violations(name, time)
        self.invariants[name].check(time)
        if self.on_tick:
            self.on_tick(name, program, stepper)
        self._require_finite(name, time)

    def _report_range_violations(self, name: str, time: Fraction) -> None:
        """Accumulate the fault bits and record an event for each newly saturated signal (rule 18).

        A fault bit and a signal are reported once in a run, with the time and the mode.
        """
        stepper, program = self.steppers[name], self.programs[name]
        known, word = self.fault_words.get(name, 0), stepper.get("memory.faults")
        self.fault_words[name] = known | word
        for fault in fault_names(name, program, word & ~known):
            self.fault_instants[fault] = describe_instant(name, program, stepper, time)
        for signal in stepper.pop_range_violations():
            if (name, signal) not in self.reported_ranges:
                self.reported_ranges.add((name, signal))
                mode = program.mode_name(stepper.get("memory.mode"))
                text = f"`{signal}` was held in its range"
                self.events.append(range_event(float(time), name, signal, mode, text))

    def _advance_lags(self, sources: Sequence[str], time: Fraction) -> None:
        """Advance the lags of the sensors on some signals to a time [s]."""
        for run in self.signals.sensors.values():
            if run.sensor.lag and run.sensor.source in sources:
                run.lag.advance(time, self.signals.current_value(run.sensor.source))

    def _require_finite(self, name: str, time: Fraction) -> None:
        """Raise SimulationStopped if an output is infinite or NaN."""
        stepper, program = self.steppers[name], self.programs[name]
        for wire in program.outputs:
            value = stepper.get(wire.source)
            if isinstance(value, float) and not math.isfinite(value):
                place = describe_instant(name, program, stepper, time)
                raise SimulationStopped(f"{place}: output `{wire.name}` is {value}")

    def _build_trajectory(self, stopped: str | None) -> Trajectory:
        """Return the recorded rows and events as a trajectory."""
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
            piecewise_constant=self.rows.piecewise_constant(),
            fault_instants=self.fault_instants,
            faults=tuple(
                fault
                for name, program in self.programs.items()
                if program.faults
                for fault in fault_names(name, program, self.fault_words.get(name, 0))
            ),
        )
