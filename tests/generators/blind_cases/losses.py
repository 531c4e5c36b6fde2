"""Effects on the flow of torque at the motor and at the wheel (places flow.w_em, flow.w_w)."""

import numpy as np

from tests.generators.blind_cases.effect import Effect, Numbers
from tests.generators.blind_cases.true_parameters import Base

MOTOR, WHEEL = "flow.w_em", "flow.w_w"


def coulomb(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Four Maxwell-slip elements in parallel at the motor, 3 to 6 N*m in all, then constant.

    Al-Bender, Lampaert, Swevers 2005 (generalised Maxwell slip), without velocity weakening.
    Seen at the wheel it is 27 to 54 N*m, f0 can give 9 within its 20 %; it reverses with the
    motor's turning, within the gap too.
    """
    return {
        "slip_torque": strength * float(rng.uniform(3.0, 6.0)),
        "slip_angle": float(rng.uniform(0.08, 0.3)),
    }


def stribeck(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """LuGre bristles with g = F_c + (F_s - F_c) exp(-|w/w_s|^d), F_s some 3 F_c, at the motor.

    Canudas de Wit, Olsson, Astrom, Lischinsky 1995. What falls with speed is most of it, so it
    is no constant friction; its Stribeck speed lies within what launches and creeping pass.
    """
    coulomb_torque = float(rng.uniform(1.5, 2.5))
    return {
        "bristle_coulomb": strength * coulomb_torque,
        "bristle_static": strength * coulomb_torque * float(rng.uniform(3.0, 4.0)),
        "bristle_speed": float(rng.uniform(40.0, 110.0)),
        "bristle_exponent": float(rng.uniform(0.7, 1.6)),
        "bristle_stiffness": strength * float(rng.uniform(30.0, 90.0)),
    }


def mesh(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Loss z |T| (|T|/T_0)^0.2 (w/w_0)^-0.2: mesh friction over load and rolling speed.

    Niemann, Winter 2003, Maschinenelemente 2 (mu_mZ ~ load^0.2 speed^-0.2). It weakens
    drive and strengthens recuperation: an inertia or a gain would do one and the same to both.
    """
    return {"mesh_loss": strength * float(rng.uniform(0.05, 0.10))}


def drag(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """The pads keep a share of the brake torque; run-out knocks them back per turn of the wheel.

    Limpert 2011, Brake Design and Safety (seal roll-back, knock-back by run-out, residual drag).
    Acts after the brake only, fades with the way driven.
    """
    return {
        "drag_share": strength * float(rng.uniform(0.18, 0.30)),
        "drag_limit": strength * float(rng.uniform(120.0, 260.0)),
        "drag_turn": float(rng.uniform(70.0, 160.0)),
        "drag_s": float(rng.uniform(4.0, 9.0)),
    }


def grade(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """m g r sin(slope), from one slope to the next over a vertical curve of the road.

    AASHTO 2018, Policy on Geometric Design (vertical curves); slopes of 1 to 5 % drawn anew in
    each recording (see `surroundings`): what differs between recordings is no parameter.
    """
    return {"grade_share": strength}


def unknown(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Unrecorded brake, half-sine hit or push in windows of time, drawn in each recording.

    Gillespie 1992, Fundamentals of Vehicle Dynamics (ride over an obstacle); windows
    are in the labels: outside of them nothing acts.
    """
    return {"unknown_share": strength}


EFFECTS = (
    Effect("coulomb_friction", MOTOR, coulomb, "dry friction"),
    Effect("stribeck_friction", MOTOR, stribeck, "dry friction"),
    Effect("load_dependent_loss", MOTOR, mesh),
    Effect("brake_drag", WHEEL, drag),
    Effect("road_grade", WHEEL, grade),
    Effect("unknown_input", WHEEL, unknown),
)
