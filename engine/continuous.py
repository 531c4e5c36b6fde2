"""Continuous: moves a continuous automaton through time, from event to event (rules 1, 4, 7-12)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Protocol

from engine.cruise import Cruise
from engine.firing import event, fired
from engine.interpreter import Stepper
from engine.invariant_watch import InvariantWatch
from engine.keeping import Records
from engine.range_watch import RangeWatch
from engine.trajectory import Event
from language.program import Program, TransitionInfo, short
from language.stepping import EVENTS_PER_STEP

Flow = tuple[Fraction, Fraction, Sequence[float], float]
"""Where a flow began and was to end, and the states and age of the records at its start."""


class Around(Protocol):
    """What surrounds a continuous automaton: who sets its inputs and who watches it."""

    is_watching: bool
    is_still: bool

    def aim(self, start: Fraction, stop: Fraction) -> None:
        """Set the inputs for a flow from `start` to `stop`."""

    def place(self, time: Fraction) -> None:
        """Set the inputs to what they are at a time of that flow."""

    def watch(self, time: Fraction) -> None:
        """See the outputs at the start of a flow, and at its end before anything jumps."""

    def look(self, time: Fraction) -> None:
        """See the outputs at a time that was asked for."""


class Alone:
    """Surroundings in which nothing changes and nobody watches."""

    is_watching = False
    is_still = True

    def aim(self, start: Fraction, stop: Fraction) -> None:
        """Leave the inputs as they are."""

    def place(self, time: Fraction) -> None:
        """Leave the inputs as they are."""

    def watch(self, time: Fraction) -> None:
        """See nothing."""

    def look(self, time: Fraction) -> None:
        """See nothing."""


class Stopped(Exception):
    """The run cannot go on: the message says what happened, where and when."""


class ContinuousRun:
    """One continuous automaton at one time: exact (a fraction of a second).

    It runs the parts of the Program's `step` one by one, and sees each event.
    """

    def __init__(
        self,
        name: str,
        program: Program,
        stepper: Stepper,
        log: Callable[[Event], None],
        around: Around | None = None,
    ) -> None:
        """Take the inputs from the stepper as they are; `start` enters the initial mode.

        `stepped` is called after each major step; `off_step` is the first time at which something
        outside happened between two of them.
        """
        self._around = around or Alone()
        self._looks: deque[Fraction] = deque()
        self.name = name
        self.program = program
        self.stepper = stepper
        self.time = Fraction(0)
        self._log = log
        self._records = Records(program, stepper)
        self.stepped: Callable[[], None] | None = None
        self.off_step: Fraction | None = None
        self._in_step: list[TransitionInfo] = []
        self.is_settled = False
        self._regions = tuple(program.mode_variables())
        states = tuple(v.name for v in program.variables if v.name.startswith("state."))
        self._states = states
        self._read_states = stepper.reader(states)
        self._ranges = RangeWatch(name, program, stepper, log)
        self._invariants = InvariantWatch(name, program, stepper, log)
        is_plain = not (program.invariants or self._records.is_needed)
        is_alone = self._around.is_still and not self._around.is_watching
        self._cruise = Cruise(program, stepper, self._ranges) if is_plain and is_alone else None

    def start(self) -> None:
        """Put the states where they start; `settle` enters the initial mode (rule 16)."""
        self._records.start()
        self.stepper.run("latch")
        self.stepper.run("start")
        self.stepper.run("equations")
        self.is_settled = False

    def flow_to(self, time: Fraction, looks: Sequence[Fraction] = ()) -> None:
        """Flow up to `time`, through every event before it. Raises Stopped.

        An event at `time` itself is left to `settle`: inputs that step there come first. `looks`
        are times before it at which the outputs are looked at; they change nothing.
        """
        self._looks = deque(looks)
        step = self.program.major_step
        while self.time < time:
            is_begun = self._cruise_to(time)
            if self.time < time:
                boundary = (self.time // step + 1) * step
                self._major_step(min(boundary, time), time, is_begun)
                if self.time < time:
                    self.end_step()
        if time % step and self.off_step is None:
            self.off_step = time

    def end_step(self) -> None:
        """Tell that a major step is done, when everything at its end has happened."""
        if self.stepped and self.time % self.program.major_step == 0:
            self.stepper.run("equations")
            self.stepped()

    def settle(self) -> None:
        """Jump before flow: micro-steps until no transition is enabled, then equations."""
        bound = sum(len(self.program.modes_of(region)) for region in self._regions)
        self.stepper.run("latch")
        done: list[TransitionInfo] = []
        for micro_step in range(bound + 1):
            self.stepper.run("jump")
            taken = fired(self.program, self.stepper)
            if not taken:
                break
            done += taken
            if micro_step == bound:
                raise Stopped(f"{self._here()}: {_fired(done)} fire for ever at one instant")
            for info in taken:
                self._log(event(self.name, self.program, info, float(self.time), micro_step))
        self._in_step += done
        self.stepper.run("watch")
        self.stepper.run("equations")
        self._ranges.look(self.time)
        self._invariants.look(self.time)
        self._around.watch(self.time)
        self.is_settled = True

    def _cruise_to(self, horizon: Fraction) -> bool:
        """Take whole steps before the horizon; tell whether one is begun where something happens.

        A step inside which someone looks is not taken.
        """
        cruise = self._cruise
        if cruise is None or cruise.place(self.time)[1]:
            return False
        (now, _), (last, is_beyond) = cruise.place(self.time), cruise.place(horizon)
        is_begun = False
        self.stepper.run("latch")
        while now < last and not is_begun:
            look, is_inside = cruise.place(self._looks[0]) if self._looks else (last, True)
            if look == now:
                break
            stop = now + 1 if self.stepped else min(look, last)
            now, is_begun = cruise.go(now, stop)
            if is_begun or (now == last and not is_beyond):
                break
            self.stepper.run("equations")
            if now == look and not is_inside:
                self._around.look(self._looks.popleft())
            if self.stepped:
                self.stepped()
        self.time = now * self.program.major_step
        return is_begun

    def _major_step(self, end: Fraction, horizon: Fraction, is_begun: bool) -> None:
        """Flow to the end of a step, through all events in it; its first segment may be done."""
        self._in_step = []
        if not is_begun:
            self.stepper.set("work.left", float(end - self.time))
        for piece in range(EVENTS_PER_STEP + 1):
            if self.time >= end:
                return
            is_event = self._arrive(end) if is_begun and piece == 0 else self._segment(end)
            if is_event and self.time < horizon:
                self.settle()
            self.is_settled = self.is_settled and not (is_event and self.time == horizon)
            self._look_here(horizon)
        if self.time < end:
            text = f"more than {EVENTS_PER_STEP} events in one step"
            raise Stopped(f"{self._here()}: {text}: {_fired(self._in_step)}")

    def _segment(self, end: Fraction) -> bool:
        """Flow to the end of the step or the next event in it; tell whether there is one."""
        stepper = self.stepper
        stepper.run("limit")
        h = stepper.get("work.h")
        start, states = self.time, self._read_states()
        stop = end if h == stepper.get("work.left") else min(end, start + Fraction(h))
        self._records.leave(start)
        age = self._records.age()
        self._around.aim(start, stop)
        stepper.run("latch")
        stepper.run("flow")
        stepper.run("elapse")
        return self._arrive(end, (start, stop, states, age))

    def _arrive(self, end: Fraction, flow: Flow | None = None) -> bool:
        """Time has elapsed up to the end of the step or an event, which it tells."""
        self._require_finite()
        stepper = self.stepper
        is_over = stepper.get("work.left") <= 0.0
        self.time = end if is_over else self.time + Fraction(stepper.get("work.elapsed"))
        self._ranges.look(self.time)
        if flow and self._looks and self._looks[0] < self.time:
            self._look_inside(*flow)
        self._place(self.time)
        if self._around.is_watching or self.program.invariants:
            stepper.run("equations")
        self._invariants.look(self.time)
        if self._around.is_watching:
            self._around.watch(self.time)
        return bool(stepper.get("work.event"))

    def _place(self, time: Fraction) -> None:
        self._around.place(time)
        self.stepper.run("latch")

    def _look_inside(
        self, start: Fraction, stop: Fraction, states: Sequence[float], age: float
    ) -> None:
        """Look at times inside the flow that was just done, on the polynomial of its method.

        So what is recorded has no influence: states and inputs are put back as they were.
        """
        ends, end_age = self._read_states(), self._records.age()
        self._put(states)
        self._around.aim(start, stop)
        self.stepper.run("latch")
        self._records.put_age(age)
        self.stepper.run("dense")
        while self._looks and self._looks[0] < self.time:
            time = self._looks.popleft()
            self._put(states)
            self.stepper.set("work.s", float(time - start))
            self.stepper.run("peek")
            self._records.put_age(age + float(time - start))
            self._look(time)
        self._put(ends)
        self._records.put_age(end_age)

    def _look_here(self, horizon: Fraction) -> None:
        """Look at the present time if it was asked for, after all its jumps."""
        if self._looks and self._looks[0] == self.time < horizon:
            self._looks.popleft()
            self._look(self.time)

    def _look(self, time: Fraction) -> None:
        self._place(time)
        self.stepper.run("equations")
        self._around.look(time)

    def _put(self, states: Sequence[float]) -> None:
        for name, value in zip(self._states, states, strict=True):
            self.stepper.set(name, value)

    def _require_finite(self) -> None:
        for name, value in zip(self._states, self._read_states(), strict=True):
            if not math.isfinite(value):
                raise Stopped(f"{self._here()}: state `{short(name)}` is {value}")

    def _here(self) -> str:
        mode = self.program.mode_name(self.stepper.get("memory.mode"))
        return f"t = {float(self.time):.9g} s, `{self.name}` in mode `{mode}`"


def _fired(infos: Sequence[TransitionInfo]) -> str:
    """Return the transitions that fired, each once, by key path."""
    return ", ".join(f"`{key}`" for key in dict.fromkeys(info.key for info in infos))
