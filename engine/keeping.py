"""Keeping: what a continuous automaton remembers - its delayed quantities, the age of its modes."""

from __future__ import annotations

from fractions import Fraction

from engine.interpreter import Stepper
from language.program import Program


class Records:
    """Delayed quantities: recorded at each major step, before time leaves it."""

    def __init__(self, program: Program, stepper: Stepper) -> None:
        """Take the Program; one without delays records nothing."""
        self._stepper = stepper
        self._step = program.major_step
        self._is_needed = "record" in program.blocks
        self._last: Fraction | None = None

    def start(self) -> None:
        """Begin anew: `init` has filled every history with the value of now."""
        self._last = None

    def leave(self, time: Fraction) -> None:
        """Record at a major step that time is about to leave."""
        if self._is_needed and time != self._last and time % self._step == 0:
            self.age(time)
            self._stepper.run("record")
            self._last = time
        self.age(time)

    def age(self, time: Fraction) -> None:
        """Tell the Program how long ago the last record was."""
        if self._is_needed:
            since = Fraction(0) if self._last is None else time - self._last
            self._stepper.set("memory.age", float(since))


class Alarms:
    """Times since the entry of modes: one is due when its time has passed (rule 8)."""

    def __init__(self, program: Program, stepper: Stepper, due: dict[str, Fraction]) -> None:
        """Take the Program and the table of time events, where alarms stand by their variable."""
        self._alarms = program.alarms
        self._stepper = stepper
        self._due = due

    def enter(self, region: str, mode: int, time: Fraction) -> None:
        """A region enters a mode: its alarms are wound up, those of the others end."""
        for alarm in self._alarms:
            if alarm.region == region:
                self._due.pop(alarm.variable, None)
                self._stepper.set(alarm.variable, False)
                if alarm.mode == mode:
                    self._due[alarm.variable] = time + alarm.time

    def ring(self, time: Fraction) -> None:
        """Make true what is due."""
        for alarm in self._alarms:
            due = self._due.get(alarm.variable)
            if due is not None and due <= time:
                self._stepper.set(alarm.variable, True)
                del self._due[alarm.variable]
