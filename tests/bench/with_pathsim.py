"""With pathsim: one ODE block, a zero crossing for each guard, Runge-Kutta-Dormand-Prince 5(4)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pathsim import Simulation
from pathsim.blocks import ODE
from pathsim.events import ZeroCrossingDown
from pathsim.solvers import RKDP54

from tests.bench.driveline import rates_and_guards
from tests.bench.manoeuvre import Manoeuvre
from tests.bench.truth import Solution

OPTIONS = {"tolerance_lte_rel": 1e-6, "tolerance_lte_abs": 1e-6, "dt_max": 0.01, "dt": 0.001}
CLOSE = 1e-9
"""How close to zero a guard counts as crossed [rad, rad/s]."""


def prepared(case: Manoeuvre) -> Callable[[], Solution]:
    """Return what runs a manoeuvre once, block and simulation made anew."""
    return lambda: _run(case)


def _run(case: Manoeuvre) -> Solution:
    contact, gap, free = rates_and_guards(case)
    alpha, torque, mode = case.values()["alpha"], 0.0, 1
    events: list[tuple[float, int]] = []

    def rates(x: Any, u: Any, t: float) -> Any:
        return np.array((contact if mode else gap)(x, torque))

    plant = ODE(rates, np.array([float(value) for value in case.start()]))

    def crossing(own: int, guard: Callable[[Any], float], new: int) -> Any:
        """A guard of one mode that ends it where it falls below zero."""

        def act(t: float) -> None:
            nonlocal mode
            mode = new
            state = plant.engine.get().copy()
            if new:
                state[3] = new * alpha
            plant.engine.set(state)
            events.append((float(t), new))
            for one in guards:
                one.off()
            for one in of_mode[new]:
                one.on()

        return ZeroCrossingDown(lambda t: guard(plant.engine.get()), act, tolerance=CLOSE)

    of_mode = {
        1: [crossing(1, free, 0)],
        0: [
            crossing(0, lambda y: alpha - y[3], 1),
            crossing(0, lambda y: alpha + y[3], -1),
        ],
        -1: [crossing(-1, lambda y: -free(y), 0)],
    }
    guards = [one for group in of_mode.values() for one in group]
    for one in (*of_mode[0], *of_mode[-1]):
        one.off()
    simulation = Simulation([plant], [], guards, Solver=RKDP54, log=False, **OPTIONS)
    start = 0
    for stop, value in zip((case.step_ms, case.horizon_ms), case.torques, strict=True):
        torque = float(value)
        simulation.run((stop - start) / 1000)
        start = stop
    w_em = np.array([float(plant.engine.get()[0])])
    return Solution(tuple(events), (case.horizon_ms,), w_em)
