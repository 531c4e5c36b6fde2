"""Input connections: sets the inputs of the instances of a system from its connections."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping
from fractions import Fraction

from engine.execution.event_loop import SimulationStopped
from engine.interpreter.interpreter import Stepper
from engine.simulation.signal_values import Signals
from language.ir.program import Program, unqualified_name
from language.model.system import Connection, System


class InputWiring:
    """Connections of each instance, and the samples that each tick has already used.

    `wires` are the connections by instance.
    """

    def __init__(
        self,
        system: System,
        programs: Mapping[str, Program],
        steppers: Mapping[str, Stepper],
        signals: Signals,
    ) -> None:
        """Group the connections by instance."""
        self.system = system
        self.programs = programs
        self.steppers = steppers
        self.signals = signals
        self.wires: dict[str, list[Connection]] = {name: [] for name in programs}
        for (owner, _), connection in system.connections.items():
            self.wires[owner].append(connection)
        self._seen: dict[tuple[str, str, str], int] = {}
        self._flags = self._inputs_with_variable("is_new.")
        self._saturated = self._inputs_with_variable("latched.")

    def _inputs_with_variable(self, group: str) -> set[tuple[str, str]]:
        """Return the inputs, as instance and name, that have a variable in a group."""
        return {
            (name, unqualified_name(variable.name))
            for name, program in self.programs.items()
            for variable in program.variables
            if variable.name.startswith(group)
        }

    def set_inputs(self, name: str, time: Fraction) -> bool:
        """Set the connected inputs of an instance; return whether one changed.

        Inputs of type bool, int and enum are converted. Raises SimulationStopped for an input that
        is not finite, unless the Program saturates it; `time` [s] is for this message.
        """
        stepper, changed = self.steppers[name], False
        for connection in self.wires[name]:
            input_name = connection.target[1]
            value = self.signals.evaluate_connection(connection)
            kind = self.system.instances[name].automaton.inputs[input_name].type
            if kind != "real":
                value = bool(value) if kind == "bool" else int(value)
            before = stepper.get(f"input.{input_name}")
            stepper.set(f"input.{input_name}", value)
            now = stepper.get(f"input.{input_name}")
            if not math.isfinite(now) and (name, input_name) not in self._saturated:
                place = describe_instant(name, self.programs[name], stepper, time)
                raise SimulationStopped(f"{place}: input `{input_name}` is {now}")
            changed = changed or now != before
        return changed

    def flag_new_inputs(self, name: str, sampling: Container[str]) -> None:
        """Set the flags `is_new` of the measured inputs of an instance.

        A flag is true if a sensor that the input reads has sampled since the last call for this
        instance. `sampling` has the names of the sensors with a sample period; an input that reads
        none of them keeps its flag.
        """
        for connection in self.wires[name]:
            input_name = connection.target[1]
            read = [sensor for sensor in connection.reads if sensor in sampling]
            if read and (name, input_name) in self._flags:
                counts = {sensor: self.signals.sensors[sensor].count for sensor in read}
                are_new = [self._seen.get((name, input_name, s), 0) != n for s, n in counts.items()]
                self._seen.update({(name, input_name, s): count for s, count in counts.items()})
                self.steppers[name].set(f"is_new.{input_name}", any(are_new))


def describe_instant(name: str, program: Program, stepper: Stepper, time: Fraction) -> str:
    """Return the text "t = <time> s, `<instance>` in mode `<mode>`" for a message.

    The time has nine significant digits, the mode is that of the chart.
    """
    mode = program.mode_name(stepper.get("memory.mode"))
    return f"t = {float(time):.9g} s, `{name}` in mode `{mode}`"
