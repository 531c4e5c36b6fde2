"""With pathsim: one ODE block, a zero crossing for each guard, Runge-Kutta-Dormand-Prince 5(4)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pathsim import Simulation
from pathsim.blocks import ODE
from pathsim.events import ZeroCrossingDown
from pathsim.solvers import RKDP54

from tests.benchmark.driveline import rates_and_guards
from tests.benchmark.manoeuvre import Manoeuvre
from tests.benchmark.reference_solution import Solution

OPTIONS = {"tolerance_lte_rel": 1e-6, "tolerance_lte_abs": 1e-6, "dt_max": 0.01, "dt": 0.001}
CLOSE = 1e-9
"""How close to zero a guard counts as crossed [rad, rad/s]."""


def prepared(case: Manoeuvre) -> Callable[[], Solution]:
    """Return what runs a manoeuvre once, block and simulation made anew."""
    return lambda: _run(case)


def _run(case: Manoeuvre) -> Solution:
    plant = _Plant(case)
    guards = [one for group in plant.guards.values() for one in group]
    simulation = Simulation([plant.block], [], guards, Solver=RKDP54, log=False, **OPTIONS)
    start = 0
    for stop, value in zip((case.step_ms, case.horizon_ms), case.torques, strict=True):
        plant.torque = float(value)
        simulation.run((stop - start) / 1000)
        start = stop
    w_em = np.array([float(plant.block.engine.get()[0])])
    return Solution(tuple(plant.events), (case.horizon_ms,), w_em)


class _Plant:
    """The driveline in contact (mode 1 or -1) or in the gap (0): a block, guards by mode."""

    def __init__(self, case: Manoeuvre) -> None:
        self.contact, self.gap, free = rates_and_guards(case)
        alpha = self.alpha = case.values()["alpha"]
        self.torque, self.mode = 0.0, 1
        self.events: list[tuple[float, int]] = []
        self.block = ODE(self.rates, np.array([float(value) for value in case.start()]))
        self.guards = {
            1: [self.crossing(free, 0)],
            0: [
                self.crossing(lambda y: alpha - y[3], 1),
                self.crossing(lambda y: alpha + y[3], -1),
            ],
            -1: [self.crossing(lambda y: -free(y), 0)],
        }
        self.switch()

    def rates(self, x: Any, u: Any, t: float) -> Any:
        return np.array((self.contact if self.mode else self.gap)(x, self.torque))

    def crossing(self, guard: Callable[[Any], float], new: int) -> Any:
        """A guard that ends its mode where it falls below zero."""

        def act(t: float) -> None:
            state = self.block.engine.get().copy()
            if new:
                state[3] = new * self.alpha
            self.block.engine.set(state)
            self.events.append((float(t), new))
            self.mode = new
            self.switch()

        return ZeroCrossingDown(lambda t: guard(self.block.engine.get()), act, tolerance=CLOSE)

    def switch(self) -> None:
        """Let only the guards of the mode act."""
        for mode, group in self.guards.items():
            for one in group:
                one.on() if mode == self.mode else one.off()
