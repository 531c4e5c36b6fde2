"""Range monitor: reports variables of a continuous automaton that leave their range (rule 18)."""

from __future__ import annotations

import sys
from collections.abc import Callable
from fractions import Fraction
from operator import le

from engine.interpreter.interpreter import Stepper
from engine.results.sampled_run import Event
from language.ir.program import Program, unqualified_name
from language.programs.system_program import RANGE_TOLERANCE

FINITE_RANGE = (-sys.float_info.max, sys.float_info.max)
"""Range of a state without a declared range: all finite numbers."""


class RangeMonitor:
    """Monitor of the ranges of one continuous automaton; values are not saturated."""

    def __init__(
        self, name: str, program: Program, stepper: Stepper, log: Callable[[Event], None]
    ) -> None:
        """Take the automaton and the function that receives events."""
        self._name, self._program, self._stepper, self._log = name, program, stepper, log
        self._bounds = {v.name: v.range for v in program.variables if v.range is not None}
        self._read = stepper.make_reader(tuple(self._bounds))
        self._outside: set[str] = set()
        states = [v.name for v in program.variables if v.name.startswith("state.")]
        limits = {**dict.fromkeys(states, FINITE_RANGE), **self._bounds}
        self._read_all = stepper.make_reader(tuple(limits))
        self._lows = tuple(low for low, _ in limits.values())
        self._highs = tuple(high for _, high in limits.values())

    def is_inside(self) -> bool:
        """Return whether all states are finite and all variables within their ranges.

        There is no tolerance. The result is False as long as a variable that `check` reported has
        not been seen inside by `check`.
        """
        values = self._read_all()
        is_inside = all(map(le, self._lows, values)) and all(map(le, values, self._highs))
        return is_inside and not self._outside

    def check(self, time: Fraction) -> None:
        """Log an event for each variable with a declared range that left it since the last call.

        The range is widened on both sides by `RANGE_TOLERANCE` times its width; NaN is outside. A
        variable that returned to its range is reported again when it leaves.
        """
        for (variable, (low, high)), value in zip(self._bounds.items(), self._read(), strict=True):
            slack = RANGE_TOLERANCE * (high - low)
            if low - slack <= value <= high + slack:
                self._outside.discard(variable)
            elif variable not in self._outside:
                self._outside.add(variable)
                mode = self._program.mode_name(self._stepper.get("memory.mode"))
                text = format_range_violation(variable, value, low, high)
                self._log(
                    range_event(float(time), self._name, unqualified_name(variable), mode, text)
                )


def format_range_violation(variable: str, value: float, low: float, high: float) -> str:
    """Return the message "`name` = value is outside its range low .. high".

    The name is without its group; the value has six significant digits.
    """
    return f"`{unqualified_name(variable)}` = {value:.6g} is outside its range {low:g} .. {high:g}"


def range_event(time: float, instance: str, signal: str, mode: str, message: str) -> Event:
    """Return the event of a signal that left its range at a time [s].

    It has the kind `range`, the name `range <signal>`, and `mode` as source and target.
    """
    return Event(time, 0, instance, f"range {signal}", mode, mode, kind="range", message=message)
