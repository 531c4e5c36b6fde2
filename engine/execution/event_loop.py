"""Event loop: advances a continuous automaton from event to event (rules 1, 4 and 7-12)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import NamedTuple

from engine.execution.delay_recorder import DelayRecorder
from engine.execution.environment_protocol import ConstantEnvironment, Environment
from engine.execution.fast_path import FastPath
from engine.execution.invariant_monitor import InvariantMonitor
from engine.execution.range_monitor import RangeMonitor
from engine.execution.transition_events import fired_transitions, transition_event
from engine.interpreter.interpreter import Stepper
from engine.results.sampled_run import Event
from language.ir.program import Program, TransitionInfo, unqualified_name
from language.programs.major_step import MAX_EVENTS_PER_STEP

SHORTEST_FLOW = Fraction(1, 2**52)
"""Longest part of a major step over which nothing flows.

The times of a scenario are exact and may be this close. States do not change measurably in such a
time, and the square of a shorter one may round to zero.
"""
FlowSegment = tuple[Fraction, Fraction, Sequence[float], float]
"""Start and planned end [s] of a flow, and the states and age of the delay records at its start."""


class PartialStep(NamedTuple):
    """Major step whose first segment has been executed.

    `flow` is that segment if outputs are sampled inside it, else None.
    """

    flow: FlowSegment | None


class SimulationStopped(Exception):
    """Error that ends a run; the message says what happened, where and when."""


class ContinuousRun:
    """Continuous automaton at an exact time [s].

    The parts of the block `step` of the Program are run one by one, so that each event is visible.
    """

    def __init__(
        self,
        name: str,
        program: Program,
        stepper: Stepper,
        log: Callable[[Event], None],
        environment: Environment | None = None,
    ) -> None:
        """Take the automaton with its stepper, event receiver and environment.

        `on_step` is called after each major step. `off_step` is the first time at which something
        outside happened between two major steps, else None.
        """
        self._around = environment or ConstantEnvironment()
        self._looks: deque[Fraction] = deque()
        self.name = name
        self.program = program
        self.stepper = stepper
        self.time = Fraction(0)
        self._log = log
        self._records = DelayRecorder(program, stepper)
        self.on_step: Callable[[], None] | None = None
        self.off_step: Fraction | None = None
        self._in_step: list[TransitionInfo] = []
        self.is_settled = False
        self._regions = tuple(program.mode_variables())
        states = tuple(v.name for v in program.variables if v.name.startswith("state."))
        self._states = states
        self._read_states = stepper.make_reader(states)
        self._ranges = RangeMonitor(name, program, stepper, log)
        self._invariants = InvariantMonitor(name, program, stepper, log)
        is_plain = not (program.invariants or self._records.is_needed)
        is_alone = self._around.has_constant_inputs and not self._around.has_observers
        self._cruise = FastPath(program, stepper, self._ranges) if is_plain and is_alone else None

    def start(self) -> None:
        """Set the states to their initial values.

        `macro_step` then enters the initial mode (rule 16).
        """
        self._records.forget_last_record()
        self.stepper.run("latch")
        self.stepper.run("start")
        self.stepper.run("equations")
        self.is_settled = False

    def flow_to(self, time: Fraction, sample_times: Sequence[Fraction] = ()) -> None:
        """Advance to `time` [s] through every event before it. Raises SimulationStopped.

        An event at `time` itself is left to `macro_step`: inputs that step there come first. The
        outputs are sampled at `sample_times`, which lie before `time` and have no influence on the
        solution.
        """
        self._looks = deque(sample_times)
        step = self.program.major_step
        while self.time < time:
            begun = self._cruise_to(time)
            if self.time < time:
                boundary = (self.time // step + 1) * step
                self._major_step(min(boundary, time), time, begun)
                if self.time < time:
                    self.end_step()
        if time % step and self.off_step is None:
            self.off_step = time

    def end_step(self) -> None:
        """Call `on_step` if the time is a whole multiple of the major step."""
        if self.on_step and self.time % self.program.major_step == 0:
            self.stepper.run("equations")
            self.on_step()

    def settle(self) -> None:
        """Execute micro-steps until no transition is enabled, then evaluate equations (rule 11a).

        Raises SimulationStopped if more micro-steps fire than there are modes (rule 7).
        """
        bound = sum(len(self.program.modes_of(region)) for region in self._regions)
        self.stepper.run("latch")
        done: list[TransitionInfo] = []
        for micro_step in range(bound + 1):
            self.stepper.run("jump")
            taken = fired_transitions(self.program, self.stepper)
            if not taken:
                break
            done += taken
            if micro_step == bound:
                raise SimulationStopped(
                    f"{self._here()}: {_fired(done)} fire for ever at one instant"
                )
            for info in taken:
                self._log(
                    transition_event(self.name, self.program, info, float(self.time), micro_step)
                )
        self._in_step += done
        self.stepper.run("evaluate_guards")
        self.stepper.run("equations")
        self._ranges.check(self.time)
        self._invariants.check(self.time)
        self._around.observe_boundary(self.time)
        self.is_settled = True

    def _cruise_to(self, horizon: Fraction) -> PartialStep | None:
        """Take whole steps before the horizon; one in which something happens is begun."""
        cruise, step = self._cruise, self.program.major_step
        if cruise is None or cruise.locate_step(self.time)[1]:
            return None
        (now, _), (last, is_beyond) = cruise.locate_step(self.time), cruise.locate_step(horizon)
        self.stepper.run("latch")
        look = self._next_look(cruise, last)
        while now < last:
            is_seen = look == (now, True)
            states = self._read_states() if is_seen else None
            stop = now + 1 if is_seen or self.on_step else min(look[0], last)
            now, is_begun = cruise.advance(now, stop)
            if is_begun:
                self.time = now * step
                return PartialStep(
                    None if states is None else (self.time, self.time + step, states, 0.0)
                )
            if states is not None:
                self.time = now * step
                self._look_inside((now - 1) * step, self.time, states, 0.0)
                look = self._next_look(cruise, last)
            if now == last and not is_beyond:
                break
            self.stepper.run("equations")
            if look == (now, False):
                self._around.sample_outputs(self._looks.popleft())
                look = self._next_look(cruise, last)
            if self.on_step:
                self.on_step()
        self.time = now * step
        return None

    def _next_look(self, cruise: FastPath, last: int) -> tuple[int, bool]:
        return cruise.locate_step(self._looks[0]) if self._looks else (last + 1, False)

    def _major_step(self, end: Fraction, horizon: Fraction, begun: PartialStep | None) -> None:
        """Flow to the end of a step, through all events in it; its first segment may be done."""
        self._in_step = []
        if begun is None:
            self.stepper.set("work.left", float(end - self.time))
        for piece in range(MAX_EVENTS_PER_STEP + 1):
            if self.time >= end:
                return
            is_done = begun is not None and piece == 0
            is_event = self._arrive(end, begun and begun.flow) if is_done else self._segment(end)
            if is_event and self.time < horizon:
                self.settle()
            self.is_settled = self.is_settled and not (is_event and self.time == horizon)
            self._look_here(horizon)
        if self.time < end:
            text = f"more than {MAX_EVENTS_PER_STEP} events in one step"
            raise SimulationStopped(f"{self._here()}: {text}: {_fired(self._in_step)}")

    def _segment(self, end: Fraction) -> bool:
        """Flow to the end of the step or the next event in it; tell whether there is one.

        Nothing flows over a rest of at most SHORTEST_FLOW, in which there is no event.
        """
        stepper = self.stepper
        if end - self.time <= SHORTEST_FLOW * self.program.major_step:
            return self._skip_flow(end)
        stepper.run("limit")
        h = stepper.get("work.h")
        start, states = self.time, self._read_states()
        stop = end if h == stepper.get("work.left") else min(end, start + Fraction(h))
        self._records.record_step(start)
        age = self._records.age()
        self._around.interpolate_inputs(start, stop)
        stepper.run("latch")
        stepper.run("flow")
        stepper.run("advance_time")
        return self._arrive(end, (start, stop, states, age))

    def _skip_flow(self, end: Fraction) -> bool:
        """Move time to the end of a step that is too short for a flow; there is no event."""
        self._records.record_step(self.time)
        self.stepper.set("work.left", 0.0)
        while self._looks and self._looks[0] < end:
            self._look(self._looks.popleft())
        self.time = end
        self._place(end)
        if self._around.has_observers:
            self.stepper.run("equations")
            self._around.observe_boundary(end)
        return False

    def _arrive(self, end: Fraction, flow: FlowSegment | None = None) -> bool:
        """Time has elapsed up to the end of the step or an event, which it tells."""
        self._require_finite()
        stepper = self.stepper
        is_over = stepper.get("work.left") <= 0.0
        self.time = end if is_over else self.time + Fraction(stepper.get("work.elapsed"))
        self._ranges.check(self.time)
        if flow and self._looks and self._looks[0] < self.time:
            self._look_inside(*flow)
        self._place(self.time)
        if self._around.has_observers or self.program.invariants:
            stepper.run("equations")
        self._invariants.check(self.time)
        if self._around.has_observers:
            self._around.observe_boundary(self.time)
        return bool(stepper.get("work.event"))

    def _place(self, time: Fraction) -> None:
        if not self._around.has_constant_inputs:
            self._around.set_inputs(time)
            self.stepper.run("latch")

    def _look_inside(
        self, start: Fraction, stop: Fraction, states: Sequence[float], age: float
    ) -> None:
        """Look at times inside the flow that was just done, on the polynomial of its method.

        So what is recorded has no influence: states and inputs are put back as they were.
        """
        ends, end_age = self._read_states(), self._records.age()
        self._put(states)
        self._around.interpolate_inputs(start, stop)
        self.stepper.run("latch")
        self._records.set_age(age)
        self.stepper.run("dense")
        while self._looks and self._looks[0] < self.time:
            time = self._looks.popleft()
            self._put(states)
            since = float(time - start)
            self.stepper.set("work.s", since)
            self.stepper.run("peek")
            self._records.set_age(age + since)
            self._look(time)
        self._put(ends)
        self._records.set_age(end_age)

    def _look_here(self, horizon: Fraction) -> None:
        """Look at the present time if it was asked for, after all its jumps."""
        if self._looks and self._looks[0] == self.time < horizon:
            self._looks.popleft()
            self._look(self.time)

    def _look(self, time: Fraction) -> None:
        self._place(time)
        self.stepper.run("equations")
        self._around.sample_outputs(time)

    def _put(self, states: Sequence[float]) -> None:
        for name, value in zip(self._states, states, strict=True):
            self.stepper.set(name, value)

    def _require_finite(self) -> None:
        for name, value in zip(self._states, self._read_states(), strict=True):
            if not math.isfinite(value):
                raise SimulationStopped(
                    f"{self._here()}: state `{unqualified_name(name)}` is {value}"
                )

    def _here(self) -> str:
        mode = self.program.mode_name(self.stepper.get("memory.mode"))
        return f"t = {float(self.time):.9g} s, `{self.name}` in mode `{mode}`"


def _fired(infos: Sequence[TransitionInfo]) -> str:
    """Return the transitions that fired, each once, by key path."""
    return ", ".join(f"`{key}`" for key in dict.fromkeys(info.key for info in infos))
