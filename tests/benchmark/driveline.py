"""Driveline: rates and guards as a user would write them, for the rivals in Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tests.benchmark.manoeuvre import Manoeuvre

Rates = Callable[[Any, float], tuple[Any, ...]]
Guard = Callable[[Any], Any]


def rates_and_guards(case: Manoeuvre) -> tuple[Rates, Rates, Guard]:
    """Return the rates in contact and in the gap, and the rate of theta_b that would be free.

    States are w_em, w_w [rad/s], theta_d, theta_b [rad]; rates also take the motor's torque [N*m].
    """
    p = case.values()
    R, k, c = p["R"], p["k_hs"], p["c_hs"]
    J_em, b_em = p["J_em"], p["b_em"]
    J_v = p["m"] * p["r_w"] ** 2 + 4 * p["J_wh"]
    mgr = p["m"] * p["g"] * p["r_w"]
    q_0, q_1 = mgr * p["C_0"], mgr * p["C_1"] + p["b_w"]
    q_2 = mgr * p["C_2"] + p["a_aer"] * p["r_w"] ** 3

    def contact(y: Any, T_em: float) -> tuple[Any, ...]:
        w_em, w_w, theta_d, theta_b = y
        w_d = w_em / R - w_w
        T_hs = k * (theta_d - theta_b) + c * w_d
        load = q_0 + (q_1 + q_2 * w_w) * w_w
        return (T_em - T_hs / R - b_em * w_em) / J_em, (T_hs - load) / J_v, w_d, 0.0 * w_d

    def gap(y: Any, T_em: float) -> tuple[Any, ...]:
        w_em, w_w, theta_d, theta_b = y
        w_d = w_em / R - w_w
        load = q_0 + (q_1 + q_2 * w_w) * w_w
        w_b = w_d + k / c * (theta_d - theta_b)
        return (T_em - b_em * w_em) / J_em, -load / J_v, w_d, w_b

    def free(y: Any) -> Any:
        return y[0] / R - y[1] + k / c * (y[2] - y[3])

    return contact, gap, free
