"""Continuous: moves a continuous automaton through time, from event to event (rules 1, 4, 7-12)."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

from engine.interpreter import Stepper
from engine.trajectory import Event
from language.program import Program, short

EVENTS_PER_STEP = 100
"""More located events than this within one major step are Zeno behaviour (rule 12)."""


class Stopped(Exception):
    """The run cannot go on: the message says what happened, where and when."""


class ContinuousRun:
    """One continuous automaton at one time: exact (a fraction of a second), with its timers."""

    def __init__(
        self, name: str, program: Program, stepper: Stepper, log: Callable[[Event], None]
    ) -> None:
        """Take the inputs from the stepper as they are; `start` enters the initial mode."""
        self.name = name
        self.program = program
        self.stepper = stepper
        self.time = Fraction(0)
        self._log = log
        self._due: dict[int, Fraction] = {}
        self._leaving = {
            mode.number: [t for t in program.transitions if t.source == mode.number]
            for mode in program.modes
        }
        states = tuple(v.name for v in program.variables if v.name.startswith("state."))
        self._states = states
        self._read_states = stepper.reader(states)

    def start(self) -> None:
        """Enter the initial mode at time 0; guards are evaluated on the first inputs (rule 16)."""
        self.stepper.run("init")
        self.settle()

    def flow_to(self, time: Fraction) -> None:
        """Flow up to `time`, through every event on the way. Raises Stopped."""
        step = self.program.major_step
        while self.time < time:
            boundary = (self.time // step + 1) * step
            self._major_step(min(boundary, time))

    def settle(self) -> None:
        """Jump before flow: micro-steps until no transition is enabled, then equations."""
        bound = len(self.program.modes)
        fired = []
        for micro_step in range(bound + 1):
            self._mark_due()
            self.stepper.run("jump")
            number = self.stepper.get("memory.fired")
            if number == 0:
                break
            info = self.program.transitions[number - 1]
            fired.append(info.name)
            if micro_step == bound:
                chain = ", ".join(f"`{name}`" for name in fired)
                raise Stopped(f"{self._here()}: transitions fire for ever at one instant: {chain}")
            self._due.clear()
            names = self.program.mode_name
            self._log(
                Event(
                    float(self.time),
                    micro_step,
                    self.name,
                    info.name,
                    names(info.source),
                    names(info.target),
                )
            )
        self.stepper.run("watch")
        self._start_timers()
        self.stepper.run("equations")

    def _major_step(self, end: Fraction) -> None:
        located = 0
        while self.time < end:
            due = min(self._due.values(), default=end)
            stop = min(end, max(due, self.time))
            h = float(stop - self.time)
            if h > 0.0:
                self.stepper.set("work.h", h)
                self.stepper.run("flow")
                self._require_finite()
            crossed = h > 0.0 and self.stepper.get("work.crossed")
            elapsed = self.stepper.get("work.elapsed") if crossed else h
            self.time = stop if elapsed == h else self.time + Fraction(elapsed)
            if crossed or self.time >= due:
                located += 1
                if located > EVENTS_PER_STEP:
                    raise Stopped(f"{self._here()}: more than {EVENTS_PER_STEP} events in one step")
                self.settle()

    def _mark_due(self) -> None:
        mode = self.stepper.get("memory.mode")
        for k, info in enumerate(self._leaving[mode]):
            if info.timer:
                due = k in self._due and self._due[k] <= self.time
                self.stepper.set(f"memory.due_{k}", due)

    def _start_timers(self) -> None:
        """A wait is a time event at t0 + d, cancelled if the guard turns false (rule 4)."""
        mode = self.stepper.get("memory.mode")
        for k, info in enumerate(self._leaving[mode]):
            if not info.timer:
                continue
            if not self.stepper.get(f"memory.armed_{k}"):
                self._due.pop(k, None)
            elif k not in self._due:
                self._due[k] = self.time + info.wait

    def _require_finite(self) -> None:
        for name, value in zip(self._states, self._read_states(), strict=True):
            if not math.isfinite(value):
                raise Stopped(f"{self._here()}: state `{short(name)}` is {value}")

    def _here(self) -> str:
        mode = self.program.mode_name(self.stepper.get("memory.mode"))
        return f"t = {float(self.time):.9g} s, `{self.name}` in mode `{mode}`"
