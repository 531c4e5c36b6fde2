"""With scipy: the driveline as its user would write it - RK45, events that end a mode, restarts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.benchmark.manoeuvre import Manoeuvre
from tests.benchmark.reference_solution import Solution

Point = list[float]
Rates = Callable[[float, Point], Point]
Guard = Callable[[float, Point], float]


@dataclass
class Plant:
    """The driveline: rates in contact and in the gap, and its guards."""

    p: dict[str, float]

    def __post_init__(self) -> None:
        """Compute what stays."""
        p = self.p
        self.J_v = p["m"] * p["r_w"] ** 2 + 4 * p["J_wh"]
        mgr = p["m"] * p["g"] * p["r_w"]
        self.q_0, self.q_1 = mgr * p["C_0"], mgr * p["C_1"] + p["b_w"]
        self.q_2 = mgr * p["C_2"] + p["a_aer"] * p["r_w"] ** 3

    def functions(self, T_em: float) -> tuple[Rates, Rates, dict[int, list[Guard]]]:
        """Return rates in contact, rates in the gap, and by mode the guards that end it."""
        p = self.p
        R, k, c, alpha = p["R"], p["k_hs"], p["c_hs"], p["alpha"]
        J_em, b_em, J_v = p["J_em"], p["b_em"], self.J_v
        q_0, q_1, q_2 = self.q_0, self.q_1, self.q_2

        def contact(t: float, y: Point) -> Point:
            w_em, w_w, theta_d, theta_b = y
            w_d = w_em / R - w_w
            T_hs = k * (theta_d - theta_b) + c * w_d
            load = q_0 + (q_1 + q_2 * w_w) * w_w
            return [(T_em - T_hs / R - b_em * w_em) / J_em, (T_hs - load) / J_v, w_d, 0.0]

        def gap(t: float, y: Point) -> Point:
            w_em, w_w, theta_d, theta_b = y
            w_d = w_em / R - w_w
            load = q_0 + (q_1 + q_2 * w_w) * w_w
            w_b = w_d + k / c * (theta_d - theta_b)
            return [(T_em - b_em * w_em) / J_em, -load / J_v, w_d, w_b]

        def drive_ends(t: float, y: Point) -> float:
            return y[0] / R - y[1] + k / c * (y[2] - y[3])

        watched = {
            1: [falling(drive_ends)],
            0: [falling(lambda t, y: alpha - y[3]), falling(lambda t, y: alpha + y[3])],
            -1: [falling(lambda t, y: -drive_ends(t, y))],
        }
        return contact, gap, watched


def falling(guard: Guard) -> Guard:
    """Return a guard that ends a flow where it falls through zero."""
    guard.terminal, guard.direction = True, -1  # type: ignore[attr-defined]
    return guard


def run(case: Manoeuvre, rtol: float = 1e-6, max_step: float = 0.01, dense: bool = False) -> Any:
    """Return events as (time, mode) and the pieces of the solution between them."""
    plant = Plant(case.values())
    method: dict[str, Any] = {"method": "RK45", "rtol": rtol, "atol": 1e-6, "max_step": max_step}
    y = [float(value) for value in case.start()]
    t, mode, events, pieces = 0.0, 1, [], []
    for stop, torque in ((case.step_ms, case.torques[0]), (case.horizon_ms, case.torques[1])):
        contact, gap, watched = plant.functions(float(torque))
        end = stop / 1000
        while t < end:
            flow, guards = contact if mode else gap, watched[mode]
            piece = solve_ivp(flow, (t, end), y, events=guards, dense_output=dense, **method)
            t, y = float(piece.t[-1]), piece.y[:, -1].tolist()
            pieces.append(piece)
            if piece.status == 1:
                if mode:
                    mode = 0
                else:
                    mode = 1 if len(piece.t_events[0]) else -1
                    y[3] = mode * plant.p["alpha"]
                events.append((t, mode))
    return events, pieces


def solution(case: Manoeuvre) -> Solution:
    """Return what the same run finds, with the motor's speed on its own polynomials."""
    events, pieces = run(case, dense=True)
    milliseconds = tuple(range(case.horizon_ms + 1))
    ends = np.array([piece.t[-1] for piece in pieces])
    w_em = [pieces[int(np.searchsorted(ends, k / 1000))].sol(k / 1000)[0] for k in milliseconds]
    return Solution(tuple(events), milliseconds, np.array(w_em))
