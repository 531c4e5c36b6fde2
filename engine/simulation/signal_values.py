"""Signal values: present values of the inputs, outputs, sensors and delayed signals of a system."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from engine.interpreter.interpreter import Interpreter, Stepper
from engine.simulation.sensors import SensorRun
from engine.simulation.stimuli import InputSignal
from language.expressions.syntax_tree import names
from language.ir.program import Program
from language.lowering.program_builder import FORMULA_RESULT
from language.model.declaration import Formula
from language.model.system import Connection, DelayedSignal, Scenario, System
from language.programs.connection_program import (
    connection_block,
    wire_formulas,
    wires_program,
)

ReadSignal = Callable[[str], Any]
"""Function that returns the value of a signal by its name."""


class DelayLine:
    """Delayed signal of a system.

    The delay of a system input is exact, because its stimulus is known at all times. For other
    signals the stored values are used.
    """

    def __init__(self, delayed_signal: DelayedSignal, input_signal: InputSignal | None) -> None:
        """Take the delayed signal and, if its source is a system input, that stimulus."""
        self.delayed_signal = delayed_signal
        self.input_signal = input_signal
        self._stored: deque[tuple[Fraction, Any]] = deque()

    def push(self, time: Fraction, value: Any) -> None:
        """Store the value that the source has from a time [s] on; times must not decrease."""
        self._stored.append((time, value))

    def at(self, time: Fraction, since: Fraction | None = None) -> Any:
        """Return the value of the source one delay before a time [s]; earlier, its first value.

        `since` is the start of the present step: an input keeps the piece of its stimulus that is
        active then. Stored values that are no longer needed are removed, so times must not
        decrease.
        """
        delayed = time - self.delayed_signal.delay
        if self.input_signal:
            delayed_since = (
                None if since is None else max(since - self.delayed_signal.delay, Fraction(0))
            )
            return self.input_signal.at(max(delayed, Fraction(0)), delayed_since)
        while len(self._stored) > 1 and self._stored[1][0] <= delayed:
            self._stored.popleft()
        return self._stored[0][1]


class Signals:
    """Values of all signals at the instant `time` [s]."""

    def __init__(
        self,
        system: System,
        scenario: Scenario,
        programs: Mapping[str, Program],
        steppers: Mapping[str, Stepper],
    ) -> None:
        """Take the system, a resolved scenario, and the Programs and steppers of the instances."""
        formulas = wire_formulas(system, scenario)
        self._reads = {
            key: tuple(dict.fromkeys(name.path for name in names(formula.tree)))
            for key, formula in formulas.items()
        }
        self._outputs = {
            f"{owner}.{wire.name}": (steppers[owner], wire)
            for owner, program in programs.items()
            for wire in program.outputs
        }
        truths = {name for name, (_, wire) in self._outputs.items() if wire.type == "truth"}
        truths |= {name for name, thing in system.inputs.items() if thing.is_bool}
        truths |= {line.name for line in system.delayed_signals.values() if line.source in truths}
        self._wires = Interpreter(wires_program(formulas, frozenset(truths)))
        self.input_signals = {
            name: InputSignal(name, stimulus, self._evaluate_piece)
            for name, stimulus in scenario.inputs.items()
        }
        self.sensors = {
            name: SensorRun(sensor, scenario.seed) for name, sensor in system.sensors.items()
        }
        self.delay_lines = {
            name: DelayLine(line, self.input_signals.get(line.source))
            for name, line in system.delayed_signals.items()
        }
        self._inputs: dict[str, Any] = {}
        self.time = Fraction(0)
        self.read_inputs(self.time)

    def read_inputs(self, time: Fraction) -> None:
        """Set `time` [s] and the present value of every input of the system."""
        self.time = time
        self._inputs = {name: signal.at(time) for name, signal in self.input_signals.items()}

    def current_value(self, name: str) -> Any:
        """Return the present value of an output `instance.name`, input, sensor or delayed signal.

        A sampled sensor returns its latest sample; a sensor without `sample` is evaluated at
        `time`. Raises KeyError for another name.
        """
        if name in self._outputs:
            stepper, wire = self._outputs[name]
            return stepper.get(wire.source)
        if name in self._inputs:
            return self._inputs[name]
        sensor = self.sensors.get(name)
        if sensor is None:
            return self.delay_lines[name].at(self.time)
        if sensor.sensor.period is None:
            return sensor.evaluate(self.time, self.current_value(sensor.sensor.source))
        return sensor.value

    def varies(self, name: str) -> bool:
        """Return whether a signal changes between instants; False for unknown names.

        Only inputs, and delayed inputs, with a varying stimulus do.
        """
        signal = self.input_signals.get(name)
        if signal is None and name in self.delay_lines:
            signal = self.delay_lines[name].input_signal
        return signal is not None and signal.varies

    def reader_at(self, time: Fraction, since: Fraction) -> ReadSignal:
        """Return a function that reads signals at a time [s] within the step that began at `since`.

        Inputs and delayed inputs are evaluated at that time, with the piece of their stimulus that
        is active at `since`; other signals have their present values.
        """

        def read(name: str) -> Any:
            signal = self.input_signals.get(name)
            if signal:
                return signal.at(time, since)
            line = self.delay_lines.get(name)
            return line.at(time, since) if line and line.input_signal else self.current_value(name)

        return read

    def evaluate_connection(self, connection: Connection, read: ReadSignal | None = None) -> Any:
        """Return the value of a connection: a signal, an expression or a constant (as a float).

        `read` reads signals; by default their present values.
        """
        source, read = connection.source, read or self.current_value
        if isinstance(source, str):
            return read(source)
        if isinstance(source, Formula):
            return self.evaluate_formula(connection_block(connection), read)
        return source.numerator / source.denominator

    def evaluate_formula(self, block: str, read: ReadSignal) -> Any:
        """Return the value of the expression block `block` of the wires.

        The signals that it reads are set by `read` first.
        """
        for name in self._reads[block]:
            self._wires.set(f"signal.{name}", read(name))
        self._wires.run(block)
        return self._wires.get(FORMULA_RESULT)

    def _evaluate_piece(self, block: str, time: float) -> float:
        """Return the value of a formula piece of a stimulus at a time [s]."""
        return float(self.evaluate_formula(block, lambda _: time))
