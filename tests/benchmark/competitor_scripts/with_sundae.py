"""With scikit-sundae: CVODE of SUNDIALS, rates and events in Python, restarts in each mode."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from sksundae.cvode import CVODE

from tests.benchmark.driveline import rates_and_guards
from tests.benchmark.manoeuvre import Manoeuvre
from tests.benchmark.reference_solution import Solution

OPTIONS = {"method": "Adams", "rtol": 1e-8, "atol": 1e-8, "max_step": 0.01}
"""Two digits more than scipy: errors of a multistep method add up over its steps."""


def prepared(case: Manoeuvre) -> Callable[[], Solution]:
    """Return what runs a manoeuvre once."""
    alpha, torque = case.values()["alpha"], [0.0]
    solvers = {mode: _solver(case, mode, torque) for mode in (1, 0, -1)}

    def run() -> Solution:
        y = np.array([float(value) for value in case.start()])
        t, mode, events = 0.0, 1, []
        for stop, value in zip((case.step_ms, case.horizon_ms), case.torques, strict=True):
            torque[0] = float(value)
            while t < stop / 1000:
                piece = solvers[mode].solve(np.array([t, stop / 1000]), y)
                t, y = float(piece.t[-1]), np.array(piece.y[-1])
                if t < stop / 1000:
                    mode = 0 if mode else (1 if y[3] > 0 else -1)
                    if mode:
                        y[3] = mode * alpha
                    events.append((t, mode))
        return Solution(tuple(events), (case.horizon_ms,), y[:1])

    return run


def _solver(case: Manoeuvre, mode: int, torque: list[float]) -> Any:
    """Return what solves a mode until a guard ends it; `torque` [N*m] (1,) is read at each call."""
    contact, gap, free = rates_and_guards(case)
    alpha, count = case.values()["alpha"], 1 if mode else 2
    known = contact if mode else gap

    def rates(t: float, y: Any, yp: Any) -> None:
        yp[:] = known(y.tolist(), torque[0])

    def events(t: float, y: Any, e: Any) -> None:
        if mode:
            e[0] = mode * free(y)
        else:
            e[0], e[1] = alpha - y[3], alpha + y[3]

    events.terminal = [True] * count  # type: ignore[attr-defined]
    events.direction = [-1] * count  # type: ignore[attr-defined]
    return CVODE(rates, eventsfn=events, num_events=count, **OPTIONS)
