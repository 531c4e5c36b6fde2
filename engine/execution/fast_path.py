"""Fast path: executes consecutive event-free major steps of a continuous automaton."""

from __future__ import annotations

from fractions import Fraction

from engine.execution.range_monitor import RangeMonitor
from engine.interpreter.interpreter import Stepper
from language.ir.program import Program


class FastPath:
    """Execution of whole major steps with constant inputs and without observers.

    Steps are counted as integers, so that no exact time is needed between them.
    """

    def __init__(self, program: Program, stepper: Stepper, ranges: RangeMonitor) -> None:
        """Take the automaton and the monitor that tells whether all values are in range."""
        self._stepper = stepper
        self._ranges = ranges
        self._step = program.major_step
        self._h = float(program.major_step)
        self._happened = stepper.make_reader(("work.event", "work.left"))

    def locate_step(self, time: Fraction) -> tuple[int, bool]:
        """Return the index of the last major step that begins up to a time [s], and a flag.

        The index is time divided by the major step, rounded down. The flag is whether time is not a
        multiple of the step.
        """
        step = self._step
        number, rest = divmod(time.numerator * step.denominator, time.denominator * step.numerator)
        return number, rest > 0

    def advance(self, first: int, last: int) -> tuple[int, bool]:
        """Execute major steps from index `first` to `last`; return the index reached and a flag.

        The flag is false if all steps are executed; the index is then `last`. It is true if, in the
        step that begins at the index, there is an event, the flow ended early or a value is out of
        range. The first segment of that step has then been executed, that is the blocks `flow` and
        `advance_time` have run. The inputs have to be latched before the call.
        """
        run, put, h = self._stepper.run, self._stepper.set, self._h
        is_inside, happened = self._ranges.is_inside, self._happened
        while first < last:
            put("work.left", h)
            run("limit")
            run("flow")
            run("advance_time")
            is_event, left = happened()
            if is_event or left > 0.0 or not is_inside():
                return first, True
            first += 1
        return first, False
