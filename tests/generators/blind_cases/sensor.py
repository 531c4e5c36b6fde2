"""Effects between the wheel's speed and the recorded one (place outputs.w_s)."""

import numpy as np

from tests.generators.blind_cases.effect import Effect, Numbers, draw_angle, draw_signed
from tests.generators.blind_cases.true_parameters import Base

PLACE = "outputs.w_s"


def eccentricity(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Read angle x + atan2(e sin x, 1 + e cos x): a ring that runs out, seen from one side.

    Ellin, Dolsak 2008, Design and application of rotary encoders (eccentricity). Once per
    turn, grows with speed, nothing in the motor's speed answers to it.
    """
    return {
        "eccentricity": strength * float(rng.uniform(0.008, 0.02)),
        "eccentricity_phase": draw_angle(rng),
    }


def lag(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """The first-order filter is really a second-order one that comes later by 2 z / w.

    Kester 2005, Data Conversion Handbook (anti-alias filter of second order). 45 to 90 ms, high
    frequencies vanish: shuffle in w_w is smoothed as no delay would.
    """
    zeta = float(rng.uniform(0.65, 0.95))
    lateness = 0.010 + strength * float(rng.uniform(0.045, 0.090))
    return {"sense_omega": 2.0 * zeta / lateness, "sense_zeta": zeta}


def delay(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """The filtered speed is sampled by a cyclic frame with jitter and comes after a transport.

    Davis et al. 2007 (CAN). 30 to 60 ms in all; nothing is smoothed beyond the frame's hold.
    """
    return {
        "sense_transport_s": strength * float(rng.uniform(0.030, 0.055)),
        "sense_frame_s": strength * float(rng.choice([0.008, 0.010, 0.012])),
        "sense_jitter_s": strength * float(rng.uniform(0.0005, 0.0015)),
    }


def scale(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """The controller assumes another number of teeth on the ring: n / (n +- 1), n 36 to 60.

    Gustafsson 2010, Rotational speed sensors (pulse counting). R is exact, so the ratio of the
    two speeds shows it, at all torques alike.
    """
    teeth = int(rng.integers(36, 61))
    other = teeth + (1 if rng.random() < 0.5 else -1)
    return {"sense_scale": 1.0 + strength * (teeth / other - 1.0)}


def offset(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """w_w + constant, 0.25 to 0.6 rad/s: the same at all speeds, at rest too.

    Ding 2013, Model-Based Fault Diagnosis Techniques (additive sensor fault).
    """
    return {"sense_offset": strength * draw_signed(rng, 0.25, 0.6)}


EFFECTS = (
    Effect("sensor_eccentricity", PLACE, eccentricity),
    Effect("sensor_lag", PLACE, lag),
    Effect("sensor_delay", PLACE, delay),
    Effect("sensor_scale", PLACE, scale),
    Effect("sensor_offset", PLACE, offset),
)
