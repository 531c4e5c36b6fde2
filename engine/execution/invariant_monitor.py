"""Invariant monitor: reports invariants of active modes that cease to hold (rule 11b)."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from engine.interpreter.interpreter import Stepper
from engine.results.sampled_run import Event
from language.ir.program import InvariantInfo, Program

INVARIANT_BLOCK = "invariants"
"""Block of the Program that evaluates all invariants."""


class InvariantMonitor:
    """Monitor of the invariants of one automaton; each violation is reported once.

    A violation lasts from a call of `check` that finds it until one at which the invariant holds or
    its mode is not active.
    """

    def __init__(
        self, name: str, program: Program, stepper: Stepper, log: Callable[[Event], None]
    ) -> None:
        """Take the automaton and the function that receives events."""
        self._name, self._program, self._stepper, self._log = name, program, stepper, log
        self._regions = program.mode_variables()
        self._broken: set[str] = set()

    def check(self, time: Fraction) -> None:
        """Log an event at a time [s] for each invariant of an active mode that does not hold.

        An invariant that was violated at the last call, too, is not reported again. The first call
        reports each one that does not hold, and so does the first call after the entry of a mode.
        Runs INVARIANT_BLOCK on the stepper, whose equations have to be those of the present
        instant; a Program without invariants is left alone.
        """
        if not self._program.invariants:
            return
        self._stepper.run(INVARIANT_BLOCK)
        for info in self._program.invariants:
            active = self._stepper.get(self._regions[info.region]) == info.mode
            if not active or self._stepper.get(info.variable):
                self._broken.discard(info.variable)
            elif info.variable not in self._broken:
                self._broken.add(info.variable)
                self._log(invariant_event(self._name, self._program, info, float(time)))


def invariant_event(name: str, program: Program, info: InvariantInfo, time: float) -> Event:
    """Return the event of an invariant that ceases to hold at a time [s].

    It has the kind `invariant`, the name `invariant <name>`, its mode as source and target, and its
    message.
    """
    mode = program.mode_name(info.mode, info.region)
    place = (name, f"invariant {info.name}", mode, mode, info.region)
    return Event(time, 0, *place, kind="invariant", message=info.message)
