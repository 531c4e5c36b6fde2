"""Effects between the rim and the vehicle (place elements.vehicle)."""

import numpy as np

from tests.generators.blind_cases.effect import Effect, Numbers
from tests.generators.blind_cases.true_parameters import Base

PLACE = "elements.vehicle"


def inertia(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """Rims on the tyres' torsion: spring, damper, Maxwell branch of the rubber (Zener solid).

    Zegelaar 1998 (sidewall torsion of the rigid-ring tyre). The rims are a part of J_v, so the
    sum stays; the new mode near 12 to 20 Hz does not depend on speed.
    """
    stiffness = float(rng.uniform(8e3, 15e3)) / strength
    return {
        "rim_J": float(rng.uniform(2.5, 4.5)),
        "tyre_k": stiffness,
        "tyre_c": float(rng.uniform(15.0, 40.0)),
        "tyre_k_2": stiffness * float(rng.uniform(0.15, 0.35)),
        "tyre_s": float(rng.uniform(0.01, 0.04)),
    }


def slip(rng: np.random.Generator, base: Base, strength: float) -> Numbers:
    """u' = (w_w - w_v) - |w_v| u / s, torque by the Magic Formula of u / s, damped at standstill.

    Pacejka 2012, Tire and Vehicle Dynamics, ch. 4.3 and 7 (transient slip, low-speed damping).
    Like a spring at low speed and like a damper C/|w_v| at high speed, soft near the peak.
    """
    peak = float(rng.uniform(2600.0, 3400.0))
    shape = float(rng.uniform(1.5, 1.75))
    stiffness = float(rng.uniform(9e3, 17e3)) / strength
    return {
        "rim_J": float(rng.uniform(2.0, 3.5)),
        "magic_D": peak,
        "magic_C": shape,
        "magic_B": stiffness / (shape * peak),
        "magic_E": float(rng.uniform(-0.5, 0.3)),
        "relaxation": float(rng.uniform(0.9, 1.8)),
        "creep_c": float(rng.uniform(100.0, 200.0)),
    }


EFFECTS = (
    Effect("added_inertia", PLACE, inertia, "tyre"),
    Effect("tyre_slip", PLACE, slip, "tyre"),
)
