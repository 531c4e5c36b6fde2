"""Delay recorder: stores the history of delayed quantities at each major step."""

from __future__ import annotations

from fractions import Fraction

from engine.interpreter.interpreter import Stepper
from language.ir.program import Program
from language.lowering.continuous_delay import RECORD_AGE


class DelayRecorder:
    """Recorder of delayed quantities; it stores values before time leaves a major step."""

    def __init__(self, program: Program, stepper: Stepper) -> None:
        """Take the Program; without delays nothing is recorded."""
        self._stepper = stepper
        self._step = program.major_step
        self.is_needed = "record" in program.blocks
        self._last: Fraction | None = None

    def forget_last_record(self) -> None:
        """Forget the last recorded time, so that the next step is recorded.

        The histories are unchanged; the block `start` fills them.
        """
        self._last = None

    def record_step(self, time: Fraction) -> None:
        """Run the block `record` at a time [s] that is a whole multiple of the major step.

        A second call at the same time, another time and a Program without delays do nothing.
        """
        if self.is_needed and time != self._last and time % self._step == 0:
            self._stepper.run("record")
            self._last = time

    def age(self) -> float:
        """Return the time [s] since the last record; 0 without delays."""
        return float(self._stepper.get(RECORD_AGE.name)) if self.is_needed else 0.0

    def set_age(self, age: float) -> None:
        """Set the time [s] since the last record, so that delays are evaluated at another time.

        Without delays nothing is set.
        """
        if self.is_needed:
            self._stepper.set(RECORD_AGE.name, age)
