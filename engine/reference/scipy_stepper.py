"""Scipy stepper: integrates the flow of a continuous Program with scipy.

Of the Program, the vector field (`rates_<mode>`, `guards_<mode>`) and the blocks of instants
(`init`, `equations`, `evaluate_guards`, `jump`) are interpreted. Crossings are located by
bisection on the dense output of scipy.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from scipy.integrate import solve_ivp

from engine.execution.event_loop import SimulationStopped
from engine.interpreter.interpreter import Interpreter
from engine.reference.numpy_functions import numpy_functions
from engine.results.array_types import Reals
from language.ir.program import ModeInfo, Program, unqualified_name
from language.ir.root_region import CHART

ScipyMethod = Literal["DOP853", "Radau", "LSODA"]
"""Methods of scipy.

DOP853 is explicit of order 8, Radau implicit of order 5 (Hairer, Norsett, Wanner, Solving Ordinary
Differential Equations I, II.5, and II, IV.8); LSODA switches between stiff and nonstiff methods
(Petzold 1983).
"""
StateVector = list[float]
"""States in SI, in the order of the Program."""
Solution = Callable[[float], StateVector]
"""States in SI at a time [s] since the start of a flow."""

INTEGRATION_BLOCKS = (
    "flow",
    "dense",
    "peek",
    "point",
    "step",
    "series_",
    "locate_",
    "dense_guards_",
    "segment",
    "macro_step",
)
"""Names, or prefixes of names, of the blocks that integrate or locate."""
RTOL = 1e-11
"""Relative local error of a step: 2^-53 with five digits left for the sum of steps."""
MIN_SCALE = 1e-9
"""Size [SI unit of the state] below which a state counts as 0.

It prevents step sizes that are limited by rounding.
"""
MAX_EVALUATIONS = 100_000
"""Evaluations of the rates in one flow, 6000 steps of DOP853.

More mean that it does not advance.
"""
GUARD_CHECKS = 4
"""Evenly spaced guard evaluations in a flow.

Shorter pulses than a quarter of a step may be missed.
"""
BISECTIONS = 52
"""Bisections of a crossing.

1 ms / 4 / 2^52 = 6e-20 s is below one unit in the last place of any time.
"""


def without_integration(program: Program) -> Program:
    """Return a Program without the blocks whose names start with one of `INTEGRATION_BLOCKS`."""
    blocks = {
        n: block for n, block in program.blocks.items() if not n.startswith(INTEGRATION_BLOCKS)
    }
    return dataclasses.replace(program, blocks=blocks)


def evaluated_guard_slots(program: Program, mode: ModeInfo) -> tuple[str, ...]:
    """Return the slots of the guards that are evaluated in a mode of the chart, each once.

    These are the guards of transitions from the mode and of all transitions of parallel regions, in
    the order of the transitions.
    """
    infos = program.transitions
    slots = [i.slot for i in infos if i.region != CHART or i.source == mode.number]
    return tuple(dict.fromkeys(slots))


class ScipyStepper:
    """Stepper of a continuous Program whose block `flow` is executed by scipy.

    The interpreter executes all other blocks.
    """

    def __init__(self, program: Program, method: ScipyMethod = "DOP853") -> None:
        """Create an interpreter of the Program without its integration blocks.

        Its elementary functions are those of numpy.
        """
        self.program = program
        self.method = method
        functions = numpy_functions(program.number_type)
        self._inner = Interpreter(without_integration(program), functions)
        names = [v.name for v in program.variables if v.name.startswith("state.")]
        self._names = tuple(unqualified_name(name) for name in names)
        self._states = self._inner.make_reader(tuple(names))
        self._rates = self._inner.make_reader(tuple(f"work.rate_{name}" for name in self._names))
        self._sizes = np.full(len(names), MIN_SCALE)
        self._time = 0.0
        timed = ("work.rise_", "memory.age")
        self._is_timed = any(v.name.startswith(timed) for v in program.variables)
        self._guards = {}
        levels = [v.name for v in program.variables if v.name.startswith("memory.level_")]
        for mode in program.modes:
            slots = evaluated_guard_slots(program, mode)
            guards = (f"work.guard_{slot}" for slot in slots)
            before = (f"memory.armed_{slot}" for slot in slots)
            now = self._inner.make_reader(
                (*guards, *(f"work.{unqualified_name(name)}" for name in levels))
            )
            armed = self._inner.make_reader((*before, *levels))
            self._guards[mode.name] = (now, armed)

    def get(self, name: str) -> Any:
        """Return the value of a variable or constant, `group.name`, as `Interpreter.get`."""
        return self._inner.get(name)

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a variable, `group.name`, as `Interpreter.set`."""
        self._inner.set(name, value)

    def make_reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the present values of some names, in their order."""
        return self._inner.make_reader(names)

    def pop_range_violations(self) -> tuple[str, ...]:
        """Return an empty tuple: a continuous automaton has no saturation."""
        return ()

    def run(self, block: str) -> None:
        """Run a block: `flow` and `peek` by scipy, all others by the interpreter.

        `flow` advances the states by `work.h` [s] or to the first change of a guard, and sets
        `work.elapsed` and `work.crossed`; `peek` advances them by `work.s`. `dense` does nothing,
        because `peek` integrates again. Raises SimulationStopped if scipy fails or a state is not
        finite.
        """
        if block == "flow":
            self._flow(self.get("work.h"))
        elif block == "peek":
            self._peek(self.get("work.s"))
        elif block == "dense":
            return
        else:
            self._inner.run(block)

    def _flow(self, h: float) -> None:
        """Advance the states by h [s], or to the first change of a guard before that.

        `work.elapsed` and `work.crossed` tell how far and whether a guard changed.
        """
        mode = self.program.mode_name(self.get("memory.mode"))
        path = self._solve(mode, h)
        change = self._locate_first_change(mode, path, h)
        elapsed = h if change is None else change
        for name, value in zip(self._names, path(elapsed), strict=True):
            self.set(f"state.{name}", value)
        self.set("work.elapsed", elapsed)
        self.set("work.crossed", change is not None)
        self._time += elapsed

    def _peek(self, h: float) -> None:
        """Advance the states by h [s] regardless of guards."""
        mode = self.program.mode_name(self.get("memory.mode"))
        for name, value in zip(self._names, self._solve(mode, h)(h), strict=True):
            self.set(f"state.{name}", value)

    def _solve(self, mode: str, h: float) -> Solution:
        """Return the solution over h [s] from the present states.

        Raises SimulationStopped if a state or a rate is not finite or scipy fails.
        """
        start: StateVector = list(self._states())
        first = self._rates_at(mode, start, 0.0)
        for name, value, rate in zip(self._names, start, first, strict=True):
            if not (math.isfinite(value) and math.isfinite(rate)):
                raise SimulationStopped(
                    f"{self._describe_instant(mode)}: state `{name}` is {value}, its rate {rate}"
                )
        if not start:
            return lambda time: []
        moved = np.maximum(np.abs(start), h * np.abs(first))
        self._sizes = np.maximum(self._sizes, moved)
        solution = self._solve_ivp(mode, start, h)
        end: StateVector = solution.y[:, -1].tolist()

        def path(time: float) -> StateVector:
            if time == h:
                return end
            point: StateVector = solution.sol(time).tolist()
            return point

        return path

    def _solve_ivp(self, mode: str, start: StateVector, h: float) -> Any:
        """Return the result of scipy's solve_ivp over h [s] with dense output.

        No step is longer than h. Radau and LSODA, whose dense output is of lower order than their
        steps, take at least `GUARD_CHECKS` steps. Raises SimulationStopped if scipy fails or needs
        more than `MAX_EVALUATIONS`.
        """
        evaluations = 0

        def rates(time: float, point: Reals) -> StateVector:
            nonlocal evaluations
            evaluations += 1
            if evaluations > MAX_EVALUATIONS:
                raise SimulationStopped(
                    f"{self._describe_instant(mode)}: more than {MAX_EVALUATIONS} rates in one flow"
                )
            return self._rates_at(mode, point.tolist(), float(time))

        longest = h if self.method == "DOP853" else h / GUARD_CHECKS
        options = {"rtol": RTOL, "atol": RTOL * self._sizes, "max_step": longest}
        with np.errstate(over="ignore", invalid="ignore"):  # the error estimate rejects such a step
            solution = solve_ivp(
                rates,
                (0.0, h),
                start,
                self.method,
                dense_output=True,
                first_step=longest,
                **options,
            )
        if not solution.success:
            raise SimulationStopped(f"{self._describe_instant(mode)}: scipy: {solution.message}")
        return solution

    def _locate_first_change(self, mode: str, path: Solution, h: float) -> float | None:
        """Return the time [s] just after the first guard change; None if no guard changes."""
        if not self._guards[mode][0]():
            return None
        low = 0.0
        for look in range(1, GUARD_CHECKS + 1):
            high = h * (look / GUARD_CHECKS)
            if self._has_guard_changed(mode, path(high), high):
                return self._bisect(mode, path, low, high)
            low = high
        return None

    def _bisect(self, mode: str, path: Solution, low: float, high: float) -> float:
        """Return the upper end of the bisected bracket (low, high] [s] of a guard change."""
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if self._has_guard_changed(mode, path(middle), middle):
                high = middle
            else:
                low = middle
        return high

    def _has_guard_changed(self, mode: str, point: StateVector, time: float) -> bool:
        """Return whether a guard differs at a point from its value at the start of the flow."""
        now, armed = self._guards[mode]
        self._set_point(point, time)
        self._inner.run(f"guards_{mode}")
        return now() != armed()

    def _rates_at(self, mode: str, point: StateVector, time: float) -> StateVector:
        """Return the derivatives of the states at a point and time [s] of the flow."""
        self._set_point(point, time)
        self._inner.run(f"rates_{mode}")
        return list(self._rates())

    def _set_point(self, point: StateVector, time: float) -> None:
        """Set the states and the time [s] at which the blocks of rates and guards are evaluated.

        The time is set only if inputs or delays vary inside a step.
        """
        if self._is_timed:
            self._inner.set("work.s", time)
        for name, value in zip(self._names, point, strict=True):
            self._inner.set(f"work.at_{name}", value)

    def _describe_instant(self, mode: str) -> str:
        """Return the time, Program and mode for a message."""
        return f"t = {self._time:.9g} s, `{self.program.name}` in mode `{mode}`"
