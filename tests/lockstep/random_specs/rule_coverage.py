"""Hits: how often a run of a random spec did what a rule of docs/semantics.md is about.

Not among them: rule 12 (livelock and Zeno stop the engine: nothing is left to compare), 15 (the
language has no nested modes yet), 19 (systems: tests/lockstep/test_random_systems.py), 20 (static).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

import yaml

from engine.interpreter.interpreter import Interpreter
from engine.results.sampled_run import Event
from language.ir.program import Program, TransitionInfo
from tests.lockstep.random_specs.instrumented_program import ORDER, SWITCH, TWO
from tests.lockstep.random_specs.spec import Spec

SMALLEST_NORMAL = 2.0**-1022
BROKEN, LAST = "4 broken before it elapses", "4 elapses on its last tick"
RULES = (
    "1 located inside a step, discrete frozen",
    "2 advance, then jump in one tick",
    "2 rewind",
    "2 rewind beyond what is kept",
    "3 priority against the order of the file",
    BROKEN,
    LAST,
    "4 time event",
    "5 swap",
    "6 exit",
    "6 entry",
    "7 micro-steps at one instant",
    "7 one transition, the next at the next tick",
    "8 rising",
    "8 falling",
    "8 after",
    "9 crossing located in a run",
    "9 crossing located in a flow",
    "10 two guards at once",
    "11 jump before flow",
    "13 input that is not finite",
    "14 two regions at once",
    "16 guards on the first inputs",
    *(f"17 {method}" for method in ("euler", "midpoint", "rk4", "exact", "exponential")),
    "17 observer",
    *(f"18 {way}" for way in ("saturate", "hold", "fallback", "fault mode")),
)
INPUTS = ("-0.0", "subnormal", "bound", "outside")


class Hits:
    """Watches one run; `rules`, `inputs` are the counts at its end."""

    def __init__(self, spec: Spec, program: Program) -> None:
        self.rules: Counter[str] = Counter()
        self.inputs: Counter[str] = Counter()
        self.program = program
        self.spec = spec
        self.tree: Mapping[str, Any] = yaml.safe_load(spec.text)
        self.ticks = 0
        self._waits = [info for info in program.transitions if info.timer and info.ticks]
        self._back = {info.number for info in program.transitions if info.rewind_ticks}
        self._timers: dict[str, int] = {}
        self._mode = -1
        self._elapsed: list[str] = []
        self._event: Event | None = None

    def observe(self, stepper: Interpreter) -> None:
        """See what a tick left."""
        self._inputs(stepper)
        if self.program.period is None:
            self.rules[f"17 {self.tree['method']}"] += 1
        else:
            self._tick(stepper)
        self.ticks += 1

    def log(self, event: Event) -> None:
        """See an event of a continuous automaton."""
        step, time = float(self.program.major_step), event.time
        at_step = abs(time / step - round(time / step)) < 1e-9
        info = next(
            i
            for i in self.program.transitions
            if i.name == event.transition and i.key.count(f".{event.source}.")
        )
        timed = bool(info.timer) or "after(" in self._own(info).get("when", "")
        self.rules["16 guards on the first inputs"] += time == 0.0
        self.rules["11 jump before flow"] += at_step and not timed
        self.rules["4 time event"] += timed
        self.rules["1 located inside a step, discrete frozen"] += not at_step
        self.rules["9 crossing located in a flow"] += not at_step and not timed
        self.rules["7 micro-steps at one instant"] += event.micro_step > 0
        last = self._event
        is_same = last and (last.time, last.micro_step) == (time, event.micro_step)
        self.rules["14 two regions at once"] += bool(
            is_same and last and last.region != event.region
        )
        self._event = event

    def finish(self, stepper: Interpreter) -> None:
        """Read the counters of the probes."""
        for info in self.program.transitions:
            fired = self._probe(stepper, f"probe.fired_{info.number}")
            for key in self._kinds(info):
                self.rules[key] += fired
        self.rules["3 priority against the order of the file"] += self._probe(stepper, ORDER)
        self.rules["10 two guards at once"] += self._probe(stepper, TWO)
        self.rules["9 crossing located in a run"] += self._probe(stepper, SWITCH)
        for name, thing in self._limited().items():
            way = "fallback" if "fallback" in thing else str(thing.get("on_range", "saturate"))
            way = "hold" if way == "fault" else way
            self.rules[f"18 {way}"] += self._probe(stepper, f"probe.fault_{name}")

    def _limited(self) -> dict[str, Mapping[str, Any]]:
        groups = [self.tree.get(group, {}) for group in ("inputs", "states", "discrete")]
        return {name: thing for group in groups for name, thing in group.items()}

    @staticmethod
    def _probe(stepper: Interpreter, name: str) -> int:
        return int(stepper.get(name)) if stepper.has(name) else 0

    def _mode_tree(self, region: str, number: int) -> Mapping[str, Any]:
        name = self.program.mode_name(number, region)
        modes = self.tree["modes"] if region == "chart" else self.tree["regions"][region]["modes"]
        found: Mapping[str, Any] = modes[name]
        return found

    def _own(self, info: TransitionInfo) -> Mapping[str, Any]:
        found: Mapping[str, Any] = self._mode_tree(info.region, info.source)["transitions"].get(
            info.name, {}
        )
        return found

    def _kinds(self, info: TransitionInfo) -> list[str]:
        """Return the rules that a transition is about whenever it fires."""
        own = self._own(info)
        when = own.get("when", "")
        found = [f"8 {word}" for word in ("rising", "falling", "after") if f"{word}(" in when]
        found += ["5 swap"] * (own.get("reset", {}).get("x") == "z")
        found += ["6 exit"] * ("exit" in self._mode_tree(info.region, info.source))
        found += ["6 entry"] * ("entry" in self._mode_tree(info.region, info.target))
        return found + ["18 fault mode"] * (info.name == "fault_mode")

    def _inputs(self, stepper: Interpreter) -> None:
        for aim in self.spec.aims:
            if aim.type != "real" or not stepper.has(f"input.{aim.name}"):
                continue
            value = stepper.get(f"input.{aim.name}")
            self.inputs["-0.0"] += value == 0.0 and math.copysign(1.0, value) < 0.0
            self.inputs["subnormal"] += 0.0 < abs(value) < SMALLEST_NORMAL
            self.inputs["bound"] += value in (aim.low, aim.high)
            self.inputs["outside"] += not aim.low <= value <= aim.high
            self.rules["13 input that is not finite"] += not math.isfinite(value)

    def _tick(self, stepper: Interpreter) -> None:
        fired = [stepper.get(name) for name in self.program.fired_variables()]
        number = stepper.get("memory.mode")
        source = self._mode_tree("chart", self._mode if self._mode >= 0 else number)
        if "runs" in source:
            self.rules[f"17 {source['runs']['method']}"] += 1
        self.rules["17 observer"] += "observer" in source
        carries = self.ticks > 0 and ("runs" in source or "observer" in source)
        self.rules["2 advance, then jump in one tick"] += carries and fired[0] > 0
        if fired[0] in self._back:
            beyond = not stepper.get("work.ticks_back")
            self.rules["2 rewind beyond what is kept" if beyond else "2 rewind"] += 1
        self.rules["14 two regions at once"] += sum(map(bool, fired)) > 1
        self.rules["16 guards on the first inputs"] += self.ticks == 0 and any(fired)
        again = self._fired_before and fired[0] > 0
        self.rules["7 one transition, the next at the next tick"] += again
        self._fired_before = fired[0] > 0
        self._wait_ticks(stepper, fired)
        self._mode = number

    _fired_before = False

    def _wait_ticks(self, stepper: Interpreter, fired: list[int]) -> None:
        """A wait is broken where its counter falls to 0 and nothing fired; it elapses on its last
        tick where its guard, an equation, is false at the tick after.
        """
        for name in self._elapsed:
            self.rules[LAST] += not stepper.get(f"equation.{name}")
        self._elapsed = []
        for info in self._waits:
            assert info.timer
            now, before = stepper.get(info.timer), self._timers.get(info.timer, 0)
            own = [fired[0]] if info.region == "chart" else fired[1:]
            self.rules[BROKEN] += 0 < before <= info.ticks and now == 0 and not any(own)
            if info.number in own and (when := str(self._own(info)["when"])).startswith("q_"):
                self._elapsed.append(when)
            self._timers[info.timer] = now
