"""With scipy: the driveline as its user would write it - RK45, events that end a mode, restarts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.bench.manoeuvre import Manoeuvre
from tests.bench.truth import Solution

Point = list[float]
Rates = Callable[[float, Point], Point]


def run(case: Manoeuvre, rtol: float = 1e-6, max_step: float = 0.01, dense: bool = False) -> Any:
    """Return events as (time, mode) and the pieces of the solution between them."""
    p = case.values()
    R, k, c, alpha = p["R"], p["k_hs"], p["c_hs"], p["alpha"]
    J_em, b_em = p["J_em"], p["b_em"]
    J_v = p["m"] * p["r_w"] ** 2 + 4 * p["J_wh"]
    mgr = p["m"] * p["g"] * p["r_w"]
    q_0, q_1 = mgr * p["C_0"], mgr * p["C_1"] + p["b_w"]
    q_2 = mgr * p["C_2"] + p["a_aer"] * p["r_w"] ** 3
    T_em = float(case.torques[0])

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

    def coast_ends(t: float, y: Point) -> float:
        return -drive_ends(t, y)

    def drive_begins(t: float, y: Point) -> float:
        return alpha - y[3]

    def coast_begins(t: float, y: Point) -> float:
        return alpha + y[3]

    for guard in (drive_ends, coast_ends, drive_begins, coast_begins):
        guard.terminal, guard.direction = True, -1  # type: ignore[attr-defined]
    watched: dict[int, list[Any]] = {
        1: [drive_ends],
        0: [drive_begins, coast_begins],
        -1: [coast_ends],
    }
    y = [float(value) for value in case.start()]
    t, mode, events, pieces = 0.0, 1, [], []
    for stop, torque in ((case.step_ms, case.torques[0]), (case.horizon_ms, case.torques[1])):
        T_em = float(torque)
        while t < stop / 1000:
            piece = solve_ivp(
                contact if mode else gap,
                (t, stop / 1000),
                y,
                "RK45",
                rtol=rtol,
                atol=1e-6,
                max_step=max_step,
                events=watched[mode],
                dense_output=dense,
            )
            t, y = float(piece.t[-1]), piece.y[:, -1].tolist()
            pieces.append(piece)
            if piece.status == 1:
                if mode:
                    mode = 0
                else:
                    mode = 1 if len(piece.t_events[0]) else -1
                    y[3] = mode * alpha
                events.append((t, mode))
    return events, pieces


def solution(case: Manoeuvre) -> Solution:
    """Return what the same run finds, with the motor's speed on its own polynomials."""
    events, pieces = run(case, dense=True)
    milliseconds = tuple(range(case.horizon_ms + 1))
    ends = np.array([piece.t[-1] for piece in pieces])
    w_em = [pieces[int(np.searchsorted(ends, k / 1000))].sol(k / 1000)[0] for k in milliseconds]
    return Solution(tuple(events), milliseconds, np.array(w_em))
