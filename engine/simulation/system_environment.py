"""System environment: connects a continuous instance to the signals of its system."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from engine.execution.event_loop import SimulationStopped
from engine.interpreter.interpreter import Stepper
from engine.simulation.input_connections import describe_instant
from engine.simulation.signal_values import Signals
from language.ir.number_type import MAX_FINITE
from language.ir.program import Program
from language.model.system import Connection


class SystemEnvironment:
    """Environment of one continuous instance (engine/execution/environment_protocol.py).

    It sets inputs that vary within a step, advances the lags of sensors, and records outputs for
    rows.
    """

    def __init__(
        self,
        name: str,
        stepper: Stepper,
        signals: Signals,
        connections: Sequence[Connection],
        program: Program,
    ) -> None:
        """Take the instance with its Program, and the connections of its inputs.

        `looked` collects the values of `names` at each sampled time.
        """
        self.name = name
        self.sampled_rows: list[tuple[Any, ...]] = []
        self._stepper = stepper
        self._signals = signals
        variables = {variable.name for variable in program.variables}
        self._varying = [c for c in connections if f"work.rise_{c.target[1]}" in variables]
        self._outputs = [f"{name}.{wire.name}" for wire in program.outputs]
        own = [run for run in signals.sensors.values() if run.sensor.source in self._outputs]
        self._lagging = [run for run in own if run.sensor.lag]
        self._unsampled = [run for run in own if run.sensor.period is None]
        self.names = (*self._outputs, *(run.sensor.name for run in self._unsampled))
        self._read = stepper.make_reader(tuple(wire.source for wire in program.outputs))
        self._since = Fraction(0)
        self._program = program
        self._largest = MAX_FINITE[program.number_type]
        self.has_observers = bool(self._lagging)
        self.has_constant_inputs = not self._varying

    def interpolate_inputs(self, start: Fraction, stop: Fraction) -> None:
        """Set the varying inputs to parabolas over the flow from `start` to `stop` [s].

        A parabola interpolates the input at the start, the middle and the end of the flow:
        `input.<name>` is the value at the start, `work.rise_<name>` and `work.bend_<name>` are the
        factors of s and s^2. Other inputs are unchanged. Raises SimulationStopped if a factor is
        too large for the number type.
        """
        self._since = start
        h = float(stop - start)
        for connection in self._varying:
            value = self._input_function(connection)
            first, middle, last = value(start), value((start + stop) / 2), value(stop)
            rise = (4.0 * middle - 3.0 * first - last) / h
            bend = 2.0 * (first - 2.0 * middle + last) / (h * h)
            name = connection.target[1]
            if not (abs(rise) <= self._largest and abs(bend) <= self._largest):
                self._require_finite(name, start, (first, middle, last), h)
            self._stepper.set(f"input.{name}", first)
            self._stepper.set(f"work.rise_{name}", rise)
            self._stepper.set(f"work.bend_{name}", bend)

    def _require_finite(self, name: str, time: Fraction, values: Sequence[float], h: float) -> None:
        """Raise SimulationStopped if an input over `h` [s] is finite and its slope is not.

        Values that are not finite are left to the states that they make not finite.
        """
        if all(math.isfinite(value) for value in values):
            place = describe_instant(self.name, self._program, self._stepper, time)
            text = f"input `{name}` changes from {values[0]:.3g} to {values[-1]:.3g} in {h:.3g} s"
            number_type = self._program.number_type
            raise SimulationStopped(f"{place}: {text}: {number_type} has no such slope")

    def set_inputs(self, time: Fraction) -> None:
        """Set the varying inputs to their values at a time [s] of the flow; others are unchanged.

        At a discontinuity the value is the limit from below.
        """
        for connection in self._varying:
            name = f"input.{connection.target[1]}"
            self._stepper.set(name, self._input_function(connection)(time))

    def observe_boundary(self, time: Fraction) -> None:
        """Advance the lags of sensors on the outputs of the instance to a time [s].

        Sensors without a lag are left out.
        """
        for run in self._lagging:
            run.lag.advance(time, self._signals.current_value(run.sensor.source))

    def sample_outputs(self, time: Fraction) -> None:
        """Append the outputs, and the values of sensors without `sample`, at a time [s].

        The tuple in `sampled_rows` is in the order of `names`.
        """
        values = self._read()
        for run in self._unsampled:
            value = values[self._outputs.index(run.sensor.source)]
            values = (*values, run.evaluate(time, value))
        self.sampled_rows.append(values)

    def _input_function(self, connection: Connection) -> Callable[[Fraction], Any]:
        """Return a function of time [s] that evaluates a connection within the present flow."""
        return lambda time: self._signals.evaluate_connection(
            connection, self._signals.reader_at(time, self._since)
        )
