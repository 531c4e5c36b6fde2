"""Effects between the demanded torque and the torque of the machine (place inputs.T_em)."""

import numpy as np

from tests.generators.blind_cases.effect import Effect, Numbers, draw_angle, draw_signed
from tests.generators.blind_cases.true_parameters import Base

PLACE = "inputs.T_em"


def lag(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """T'' = w^2 (T_dem - T) - 2 z w T': a second-order closed current loop with set-point filter.

    Schroeder 2015, Elektrische Antriebe - Regelung (optimum of amount, z near 0.7). The low
    frequencies come late by 2 z / w = 25 to 55 ms, the high ones vanish: no delay does that.
    """
    zeta = float(rng.uniform(0.65, 0.95))
    lateness = strength * float(rng.uniform(0.025, 0.055))
    return {"lag_omega": 2.0 * zeta / lateness, "lag_zeta": zeta}


def delay(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """The demand is sampled by a cyclic CAN frame with jitter, then comes after a transport time.

    Davis, Burns, Bril, Lukkien 2007 (CAN response times and queueing jitter). All frequencies
    come late by the same time, none is weakened beyond the frame's hold.
    """
    return {
        "input_transport_s": strength * float(rng.uniform(0.020, 0.040)),
        "input_frame_s": strength * float(rng.choice([0.008, 0.010, 0.012])),
        "input_jitter_s": strength * float(rng.uniform(0.0005, 0.0015)),
    }


def rate_limit(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """|T'| <= rate, and only a share of it near zero torque (lash crossing control).

    Lagerberg, Egardt 2005 (backlash traversal limited on purpose). Small steps pass unharmed,
    large ones become ramps: nonlinear in the amplitude, as no lag is.
    """
    return {
        "rate_limit": float(rng.uniform(350.0, 700.0)) / strength,
        "rate_band": float(rng.uniform(10.0, 25.0)),
        "rate_in_band": 1.0 - min(strength, 1.0) * float(rng.uniform(0.2, 0.6)),
    }


def derating(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """|T w| <= P(heat) with a soft knee, P falling with the winding's heat (thermal network).

    Mellor, Roberts, Turner 1991 (lumped thermal model); Lemmens, Vanassche, Driesen 2014
    (derating by it). Acts above a power only: gain and drift act at all torques.
    """
    return {
        "power_limit": float(rng.uniform(32e3, 52e3)),
        "power_heat": float(rng.uniform(0.15, 0.35)),
        "power_share": min(1.0, strength),
        "heat_winding_s": float(rng.uniform(3.0, 6.0)),
    }


def drift(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Gain 1 - a * rotor heat; winding and rotor heat in series (magnet flux falls when warm).

    Mellor et al. 1991 (two nodes); Reigosa et al. 2010 (magnet temperature and torque). Each
    recording starts with a heat of its own; a function of time and load, not of power now.
    """
    return {
        "drift_gain": strength * float(rng.uniform(0.18, 0.32)),
        "heat_winding_s": float(rng.uniform(2.5, 5.0)),
        "heat_rotor_s": float(rng.uniform(2.0, 4.0)),
    }


def offset(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """T = T_dem + constant, 3.5 to 8 N*m: beyond what f0 within its 20 % (1 N*m) could feign.

    Chung, Sul 1998 (current offset; here the rectified part). Same sign in both directions of
    travel, the same in all recordings: neither friction nor slope.
    """
    return {"torque_offset": strength * draw_signed(rng, 3.5, 8.0)}


def ripple(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """A cos(p x + a) + m T cos(2 p x + b): current-sensor offset once, scale mismatch twice.

    Chung, Sul 1998, Analysis and compensation of current measurement error. Locked to the
    motor's angle, p pole pairs; the second part grows with torque.
    """
    return {
        "ripple_offset": strength * float(rng.uniform(7.0, 14.0)),
        "ripple_scale": strength * float(rng.uniform(0.06, 0.12)),
        "ripple_order": float(rng.choice([2.0, 3.0, 4.0])),
        "ripple_phase": draw_angle(rng),
        "ripple_phase_2": draw_angle(rng),
    }


EFFECTS = (
    Effect("actuator_lag", PLACE, lag),
    Effect("actuator_delay", PLACE, delay),
    Effect("torque_rate_limit", PLACE, rate_limit),
    Effect("torque_derating", PLACE, derating, "heat"),
    Effect("torque_drift", PLACE, drift, "heat"),
    Effect("torque_offset", PLACE, offset),
    Effect("torque_ripple", PLACE, ripple),
)
