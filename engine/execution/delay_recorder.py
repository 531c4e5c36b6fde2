"""Keeping: what a continuous automaton's delays remember of each major step."""

from __future__ import annotations

from fractions import Fraction

from engine.interpreter.interpreter import Stepper
from language.ir.program import Program
from language.lowering.continuous_delay import RECORD_AGE


class DelayRecorder:
    """Delayed quantities: recorded at each major step, before time leaves it."""

    def __init__(self, program: Program, stepper: Stepper) -> None:
        """Take the Program; one without delays records nothing."""
        self._stepper = stepper
        self._step = program.major_step
        self.is_needed = "record" in program.blocks
        self._last: Fraction | None = None

    def start(self) -> None:
        """Begin anew: `start` fills every history with the value of now."""
        self._last = None

    def record_step(self, time: Fraction) -> None:
        """Record at a major step that time is about to leave."""
        if self.is_needed and time != self._last and time % self._step == 0:
            self._stepper.run("record")
            self._last = time

    def age(self) -> float:
        """Return how long ago [s] the last record was."""
        return float(self._stepper.get(RECORD_AGE.name)) if self.is_needed else 0.0

    def set_age(self, age: float) -> None:
        """Say how long ago [s] the last record was: to look at another time."""
        if self.is_needed:
            self._stepper.set(RECORD_AGE.name, age)
