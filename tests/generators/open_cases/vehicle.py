"""Effects of the vehicle: wheel and body do not move as one."""

from __future__ import annotations

import numpy as np

from tests.generators.open_cases.driveline import Driveline
from tests.generators.open_cases.driveline_simulation import W_W, Part, Parts, StepMidpoint
from tests.generators.open_cases.effect import Effect, Floats, Parameters

PLACE = "elements.vehicle"


def _split(
    middle: StepMidpoint, columns: slice, body: Floats, tyre: Floats, inertia: float
) -> Floats:
    """Write the wheel's own motion; return the rate of the body's speed, at the wheel."""
    base = middle.base
    wheel = middle.state[W_W, columns]
    loss = middle.brake[columns] + base["b_w"][columns] * wheel
    middle.rate[W_W, columns] = (middle.shaft[columns] - loss - tyre) / inertia
    drag = base["cd2"][columns] * body * np.abs(body)
    resistance = (
        base["f0"][columns] * np.tanh(body / base["w_0"][columns]) + drag + middle.road[columns]
    )
    return np.asarray((tyre - resistance) / (base["J_v"][columns] - inertia))


def _added_inertia(p: Parameters, driveline: Driveline) -> Parts:
    """Wheel and rim on the torsion of the tyre's side walls (Zegelaar 1998, thesis, Delft)."""

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def vehicle(middle: StepMidpoint) -> None:
            body = middle.state[row + 1, columns]
            speed = middle.state[W_W, columns] - body
            tyre = p["k_t_Nmprad"] * middle.state[row, columns] + p["c_t_Nmsprad"] * speed
            middle.rate[row, columns] = speed
            middle.rate[row + 1, columns] = _split(middle, columns, body, tyre, p["J_w_kgm2"])

        return {"vehicle": vehicle}

    return Parts((False, True), bind)


def _tyre_slip(p: Parameters, driveline: Driveline) -> Parts:
    """Slip with relaxation, below the limit of grip (Pacejka 2006, Tyre and Vehicle Dynamics, 8.6).

    sigma*T' + abs(v)*T = C*(w_w - v), all over the rolling radius; with damping near standstill,
    where the contact patch is a spring (Bernard, Clover 1995, SAE 950311).
    """

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def vehicle(middle: StepMidpoint) -> None:
            force, body = middle.state[row, columns], middle.state[row + 1, columns]
            slip = middle.state[W_W, columns] - body
            pulled = p["C_Nm"] * slip - np.abs(body) * force
            middle.rate[row, columns] = pulled / p["sigma_rad"]
            standing = p["c_0_Nmsprad"] / (1.0 + np.square(body / 3.0))
            tyre = force + standing * slip
            middle.rate[row + 1, columns] = _split(middle, columns, body, tyre, p["J_w_kgm2"])

        return {"vehicle": vehicle}

    return Parts((False, True), bind)


VEHICLE = (
    Effect(
        "added_inertia",
        PLACE,
        lambda g, s: {
            "J_w_kgm2": g.uniform(3.5, 7.0),
            "k_t_Nmprad": g.uniform(9e3, 18e3) / s,
            "c_t_Nmsprad": g.uniform(20.0, 50.0) / s,
        },
        parts=_added_inertia,
    ),
    Effect(
        "tyre_slip",
        PLACE,
        lambda g, s: {
            "J_w_kgm2": g.uniform(2.5, 5.0),
            "C_Nm": g.uniform(8e3, 18e3) / s,
            "sigma_rad": g.uniform(0.4, 0.9),
            "c_0_Nmsprad": g.uniform(40.0, 80.0),
        },
        parts=_tyre_slip,
    ),
)
