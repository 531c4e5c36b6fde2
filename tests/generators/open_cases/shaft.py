"""Effects of the shaft: it is not one linear spring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.generators.open_cases.driveline import Driveline
from tests.generators.open_cases.driveline_simulation import (
    ANGLE_W,
    GAP,
    TWIST,
    W_EM,
    W_W,
    Part,
    Parts,
    StepMidpoint,
)
from tests.generators.open_cases.effect import Effect, Floats, Parameters, draw_sign

PLACE = "elements.half_shaft"
SLIDERS = (0.4, 1.0, 2.2)
"""Slip torques of the sliders over their mean."""


def _nonlinear(p: Parameters, driveline: Driveline) -> Parts:
    """Harder, k*x*sqrt(1 + (x/x_1)^2), or softer, k*x/sqrt(1 + abs(x)/x_1); both are monotone."""

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def shaft(middle: StepMidpoint) -> None:
            twist = middle.state[TWIST, columns] - middle.state[GAP, columns]
            if p["hardening"]:
                factor = np.sqrt(1.0 + np.square(twist / p["x_1_rad"]))
            else:
                factor = 1.0 / np.sqrt(1.0 + np.abs(twist) / p["x_1_rad"])
            middle.stiffness[columns] *= factor

        return {"shaft": shaft}

    return Parts((), bind)


def _positional(p: Parameters, driveline: Driveline) -> Parts:
    """Stiffness over the wheel angle: order 2 of a Hooke joint, 3 of a tripod (Seherr-Thoss)."""

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def shaft(middle: StepMidpoint) -> None:
            angle = p["order"] * middle.state[ANGLE_W, columns] + p["phase_rad"]
            middle.stiffness[columns] *= 1.0 + p["share"] * np.sin(angle)

        return {"shaft": shaft}

    return Parts((), bind)


def _hysteresis(p: Parameters, driveline: Driveline) -> Parts:
    """Springs with sliders beside the shaft (Iwan 1966, J. Appl. Mech. 33, 893-900)."""
    stiffness = p["share"] * driveline.k / len(SLIDERS)
    slip = p["slip_Nm"] * np.array(SLIDERS)[:, np.newaxis]

    def bind(columns: slice, row: int) -> dict[str, Part]:
        rows = slice(row, row + len(SLIDERS))

        def shaft(middle: StepMidpoint) -> None:
            middle.remembered[columns] += middle.state[rows, columns].sum(axis=0)

        def memory(middle: StepMidpoint) -> None:
            start, step = middle.start[rows, columns], middle.step
            speed = stiffness * middle.elastic[columns]
            middle.rate[rows, columns] = np.clip(
                speed, (-slip - start) / step, (slip - start) / step
            )

        return {"shaft": shaft, "memory": memory}

    return Parts((False,) * len(SLIDERS), bind)


def _left_shaft(driveline: Driveline, p: Parameters) -> Driveline:
    """Make the driveline's own shaft the left one."""
    left = 0.5 * (1.0 + p["inequality"])
    return replace(
        driveline,
        k=left * driveline.k,
        c=left * driveline.c,
        alpha=driveline.alpha * (1.0 - p["gap_inequality"]),
    )


def _right_shaft(p: Parameters, driveline: Driveline) -> Parts:
    """Two half-shafts of unequal stiffness and play, side by side; the right one added here.

    Its gap moves as that of the base, by the model of Nordin, Galic, Gutman 1997.
    """
    left = 0.5 * (1.0 + p["inequality"])
    k, c = (value * (1.0 - left) / left for value in (driveline.k, driveline.c))
    alpha = driveline.alpha * (1.0 + p["gap_inequality"]) / (1.0 - p["gap_inequality"])

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def reaction(middle: StepMidpoint) -> None:
            step, gap = middle.step, middle.start[row, columns]
            speed = middle.upstream[columns] - middle.state[W_W, columns]
            spring = k * (middle.state[TWIST, columns] - gap)
            free = (c * speed + spring) / (c + 0.5 * k * step)
            closing = np.clip(free, (-alpha - gap) / step, (alpha - gap) / step)
            torque = spring + c * speed - (c + 0.5 * k * step) * closing
            middle.rate[row, columns] = closing
            middle.shaft[columns] += torque
            middle.reaction[columns] += torque

        return {"reaction": reaction}

    return Parts((False,), bind)


def _second_gap(p: Parameters, driveline: Driveline) -> Parts:
    """A play before the shaft, a small inertia between the two; contact with penetration damping.

    Contact force after Hunt, Crossley 1975 (J. Appl. Mech. 42, 440-445).
    """
    inertia, ratio = p["J_g_kgm2"], driveline.R
    rest = driveline.J_em - inertia / ratio**2
    if rest <= 0.0:
        raise ValueError(f"no motor inertia is left beside J_g = {inertia} kg*m^2")

    def contact(angle: Floats, speed: Floats) -> Floats:
        depth = np.abs(angle) - p["alpha_2_rad"]
        damping = np.maximum(1.0 + p["damping_sprad"] * np.sign(angle) * speed, 0.0)
        return np.asarray(np.sign(angle) * p["k_2_Nmprad"] * np.maximum(depth, 0.0) * damping)

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def upstream(middle: StepMidpoint) -> None:
            middle.upstream[columns] = middle.state[row + 1, columns]

        def reaction(middle: StepMidpoint) -> None:
            speed = middle.state[W_EM, columns] / ratio - middle.state[row + 1, columns]
            torque = contact(middle.state[row, columns], speed)
            middle.rate[row, columns] = speed
            middle.rate[row + 1, columns] = (torque - middle.shaft[columns]) / inertia
            middle.reaction[columns] = torque

        def memory(middle: StepMidpoint) -> None:
            middle.rate[W_EM, columns] *= driveline.J_em / rest

        return {"upstream": upstream, "reaction": reaction, "memory": memory}

    return Parts((False, True), bind)


def _mount(p: Parameters, driveline: Driveline) -> Parts:
    """The housing turns on its mounts against the shaft torque."""

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def upstream(middle: StepMidpoint) -> None:
            middle.upstream[columns] += middle.state[row + 1, columns]

        def reaction(middle: StepMidpoint) -> None:
            angle, speed = middle.state[row, columns], middle.state[row + 1, columns]
            torque = p["k_m_Nmprad"] * angle + p["c_m_Nmsprad"] * speed
            middle.rate[row, columns] = speed
            middle.rate[row + 1, columns] = (-middle.shaft[columns] - torque) / p["J_h_kgm2"]

        return {"upstream": upstream, "reaction": reaction}

    return Parts((False, False), bind)


def _draw_mount(generator: np.random.Generator, strength: float) -> Parameters:
    inertia = generator.uniform(4.0, 9.0)
    stiffness = inertia * (2.0 * np.pi * generator.uniform(8.0, 13.0)) ** 2 / strength
    damping = 2.0 * generator.uniform(0.04, 0.10) * np.sqrt(stiffness * inertia)
    return {"J_h_kgm2": inertia, "k_m_Nmprad": stiffness, "c_m_Nmsprad": float(damping)}


SHAFT = (
    Effect(
        "unequal_half_shafts",
        PLACE,
        lambda g, s: {
            "inequality": s * draw_sign(g) * g.uniform(0.15, 0.40),
            "gap_inequality": s * g.uniform(0.4, 0.8),
        },
        driveline=_left_shaft,
        parts=_right_shaft,
    ),
    Effect(
        "second_gap",
        PLACE,
        lambda g, s: {
            "alpha_2_rad": s * g.uniform(0.012, 0.030),
            "J_g_kgm2": g.uniform(0.4, 0.8),
            "k_2_Nmprad": g.uniform(3e4, 5e4) / s,
            "damping_sprad": g.uniform(0.2, 0.4),
        },
        parts=_second_gap,
    ),
    Effect(
        "stiffness_nonlinear",
        PLACE,
        lambda g, s: {
            "hardening": float(g.choice((0.0, 1.0))),
            "x_1_rad": g.uniform(0.06, 0.12) / s,
        },
        parts=_nonlinear,
    ),
    Effect(
        "stiffness_hysteresis",
        PLACE,
        lambda g, s: {"share": s * g.uniform(0.3, 0.6), "slip_Nm": g.uniform(20.0, 50.0)},
        parts=_hysteresis,
    ),
    Effect(
        "position_dependent_stiffness",
        PLACE,
        lambda g, s: {
            "order": float(g.choice((2.0, 3.0))),
            "share": s * g.uniform(0.2, 0.4),
            "phase_rad": g.uniform(0.0, 6.283),
        },
        parts=_positional,
    ),
    Effect("mount_compliance", PLACE, _draw_mount, parts=_mount),
)
