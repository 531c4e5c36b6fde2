"""Effects of half-shaft, gaps, joints and mounts (place elements.half_shaft)."""

import numpy as np

from tests.generators.blind_cases.effect import Effect, Numbers, draw_angle, draw_signed
from tests.generators.blind_cases.true_parameters import RATIO, Base

PLACE = "elements.half_shaft"


def unequal(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Two shafts side by side, each with stiffness, half gap and gap centre of its own.

    Nordin, Gutman 2002 (survey; damped-shaft gap for each). The axle is locked: an open
    differential halves the torque and would hide the difference in one mean gap. Between the
    two gaps one shaft carries alone: knees at low torque, not alike in drive and coast.
    """
    return {
        "two_shafts": 1.0,
        "share_left": 0.5 + 0.5 * strength * draw_signed(rng, 0.15, 0.4),
        "gap_skew": min(0.9, strength * float(rng.uniform(0.45, 0.75))),
        "gap_shift": strength * base.alpha * draw_signed(rng, 0.2, 0.5),
    }


def second_gap(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Motor - gear contact with a gap - small inertia - half-shaft with the nominal gap.

    Nordin, Galic, Gutman 1997 at each gap; Crowther, Janello, Singh 2007 (in series). The
    crossing has two impacts, the first one takes speed from the motor; the play is larger by
    60 to 110 % of alpha, which alpha's 20 % cannot give. The small inertia is a part of J_em.
    """
    inertia = float(rng.uniform(0.3, 0.7))
    return {
        "J_em": base.J_em - inertia / RATIO**2,
        "mid_J": inertia,
        "mid_k": float(rng.uniform(30e3, 60e3)) / strength,
        "mid_c": float(rng.uniform(60.0, 120.0)),
        "mid_alpha": strength * base.alpha * float(rng.uniform(0.6, 1.1)),
    }


def nonlinear(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """k (x + g s [softplus((x - x0)/s) - softplus((-x - x0)/s)]): two stages, a soft knee.

    Couderc, Callenaere, Der Hagopian, Ferraris 1998 (multi-stage stiffness); hardening or
    softening beyond 240 to 480 N*m, far above the gap's own corner, alike on both sides.
    """
    hard = rng.random() < 0.5
    ratio = float(rng.uniform(0.8, 1.6)) if hard else -float(rng.uniform(0.45, 0.6))
    return {
        "knee_gain": strength * ratio,
        "knee_twist": float(rng.uniform(0.04, 0.08)),
        "knee_width": float(rng.uniform(0.006, 0.015)),
    }


def hysteresis(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """k x and four Jenkins elements in parallel that slip one after the other.

    Iwan 1966, A distributed-element model for hysteresis. Small oscillations are stiffer and
    less damped than large ones, loops do not depend on the rate: neither k, c nor a knee.
    """
    return {
        "iwan_gain": strength * float(rng.uniform(0.8, 1.5)),
        "iwan_twist": float(rng.uniform(0.04, 0.08)),
    }


def position(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """k / (1 + a cos x + b cos 3x): joint compliance once and three times per turn of the wheel.

    Serveto, Mariot, Diaby 2008 (tripod joints, third order); the energy's slope over the angle
    acts at the wheel. Locked to the wheel's angle and growing with torque: no encoder error.
    """
    return {
        "joint_1": strength * float(rng.uniform(0.10, 0.20)),
        "joint_3": strength * float(rng.uniform(0.05, 0.12)),
        "joint_phase": draw_angle(rng),
    }


def mount(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """The housing pitches on rubber: spring, damper and a Maxwell branch (Zener solid).

    Genta, Morello 2009, The Automotive Chassis (reaction torque of the power unit on mounts).
    Mode of 6 to 9 Hz that the motor's encoder sees and the wheel's does not.
    """
    inertia = float(rng.uniform(3.0, 6.0))
    corner = 2.0 * np.pi * float(rng.uniform(6.0, 9.0))
    stiffness = inertia * corner * corner / strength
    return {
        "mount_J": inertia,
        "mount_k": stiffness,
        "mount_c": 2.0 * float(rng.uniform(0.08, 0.15)) * (stiffness * inertia) ** 0.5,
        "mount_k_2": stiffness * float(rng.uniform(0.2, 0.4)),
        "mount_s": float(rng.uniform(0.01, 0.03)),
    }


EFFECTS = (
    Effect("unequal_half_shafts", PLACE, unequal, "topology"),
    Effect("second_gap", PLACE, second_gap, "topology"),
    Effect("stiffness_nonlinear", PLACE, nonlinear),
    Effect("stiffness_hysteresis", PLACE, hysteresis),
    Effect("position_dependent_stiffness", PLACE, position),
    Effect("mount_compliance", PLACE, mount),
)
