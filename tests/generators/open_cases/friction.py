"""Effects of friction: torque lost at the motor, and drag at the wheel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.generators.open_cases.driveline import Driveline
from tests.generators.open_cases.driveline_simulation import W_EM, Part, Parts, StepMidpoint
from tests.generators.open_cases.effect import Effect, Parameters, Signals, draw_sign

CREEPING = 1.5
"""Motor speed over which friction changes its sign [rad/s]."""
RELEASED = 10.0
"""Brake torque below which the brake counts as released [N*m]."""


def _coulomb(p: Parameters, driveline: Driveline) -> Parts:
    """Dry friction of seals and bearings, with the Stribeck fall where it has one.

    T_c + (T_s - T_c)*exp(-abs(w/w_s)), Tustin 1947 in Armstrong-Helouvry, Dupont,
    Canudas de Wit 1994 (Automatica 30, 1083-1138).
    """

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def friction(middle: StepMidpoint) -> None:
            speed = middle.state[W_EM, columns]
            sense = np.tanh(speed / CREEPING)
            middle.friction[columns] += p["T_c_Nm"] * sense
            if "T_s_Nm" in p:
                fall = np.exp(-np.abs(speed) / p["w_s_radps"])
                middle.friction[columns] += (p["T_s_Nm"] - p["T_c_Nm"]) * fall * sense

        return {"friction": friction}

    return Parts((), bind)


def _load_loss(p: Parameters, driveline: Driveline) -> Parts:
    """Tooth friction takes a share of what the teeth transmit (Niemann, Winter 2003, vol. 2)."""

    def bind(columns: slice, row: int) -> dict[str, Part]:
        def friction(middle: StepMidpoint) -> None:
            sense = np.tanh(middle.state[W_EM, columns] / CREEPING)
            load = np.abs(middle.reaction[columns]) / driveline.R
            middle.friction[columns] += p["share"] * load * sense

        return {"friction": friction}

    return Parts((), bind)


def _brake_drag(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    """Pads keep rubbing after a stop; the drag fades as they are knocked back."""
    touch = 1.0 - np.exp(-signals.step / 0.2)
    fade = 1.0 - np.exp(-signals.step / p["tau_s"])
    brake = np.array(signals.brake)
    contact = np.zeros(brake.shape[1])
    for torque in brake:
        pressed = torque > RELEASED
        contact += np.where(pressed, touch * (1.0 - contact), -fade * contact)
        torque += np.where(pressed, 0.0, p["drag_Nm"] * contact)
    return replace(signals, brake=brake)


def _grade(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    """A slope of its own in each recording, rolling gently."""
    count = signals.road.shape[1]
    signs = generator.choice((-1.0, 1.0), count)
    mean = p["torque_Nm"] * generator.uniform(0.4, 1.0, count) * signs
    wave = generator.uniform(0.03, 0.06, count)
    turn = 2.0 * np.pi * (wave * signals.time[:, np.newaxis] + generator.uniform(0.0, 1.0, count))
    return replace(signals, road=signals.road + mean * (1.0 + 0.1 * np.sin(turn)))


def _pulses(signals: Signals, p: Parameters, generator: np.random.Generator) -> Signals:
    """Hits at the wheel (kerb, pothole, touched brake): half sines in windows."""
    road = np.array(signals.road)
    for column, end in enumerate(signals.ends):
        for _ in range(int(generator.integers(1, 3))):
            length = min(p["length_s"] * generator.uniform(0.7, 1.4), 0.4 * end)
            start = generator.uniform(0.05 * end, 0.95 * end - length)
            size = p["torque_Nm"] * generator.uniform(0.7, 1.3)
            share = np.clip((signals.time - start) / length, 0.0, 1.0)
            road[:, column] += size * np.sin(np.pi * share)
    return replace(signals, road=road)


def _quadratic(driveline: Driveline, p: Parameters) -> Driveline:
    """Roof box, open windows: more drag over the square of the speed."""
    return replace(driveline, cd2=driveline.cd2 + p["extra_Nms2"])


FRICTION = (
    Effect(
        "coulomb_friction",
        "flow.w_em",
        lambda g, s: {"T_c_Nm": s * g.uniform(3.0, 7.0)},
        parts=_coulomb,
    ),
    Effect(
        "stribeck_friction",
        "flow.w_em",
        lambda g, s: {
            "T_c_Nm": s * g.uniform(1.5, 3.0),
            "T_s_Nm": s * g.uniform(7.0, 12.0),
            "w_s_radps": g.uniform(10.0, 30.0),
        },
        parts=_coulomb,
    ),
    Effect(
        "load_dependent_loss",
        "flow.w_em",
        lambda g, s: {"share": s * g.uniform(0.05, 0.12)},
        parts=_load_loss,
    ),
    Effect(
        "brake_drag",
        "flow.w_w",
        lambda g, s: {"drag_Nm": s * g.uniform(80.0, 180.0), "tau_s": g.uniform(1.5, 4.0)},
        signals=_brake_drag,
    ),
    Effect(
        "road_grade",
        "flow.w_w",
        lambda g, s: {"torque_Nm": s * g.uniform(120.0, 260.0)},
        signals=_grade,
    ),
    Effect(
        "unknown_input",
        "flow.w_w",
        lambda g, s: {
            "torque_Nm": s * draw_sign(g) * g.uniform(200.0, 500.0),
            "length_s": g.uniform(0.3, 0.9),
        },
        signals=_pulses,
    ),
    Effect(
        "quadratic_drag",
        "flow.w_w",
        lambda g, s: {"extra_Nms2": s * g.uniform(0.05, 0.12)},
        driveline=_quadratic,
    ),
)
