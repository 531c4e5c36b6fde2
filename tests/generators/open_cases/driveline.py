"""The driveline that a recording believes in, and one whose values are somewhat off."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

SMALLEST_ERROR, LARGEST_ERROR = 0.05, 0.20
"""Relative error of the uncertain values: what a data sheet is usually wrong by."""
SHARPNESS = (0.15, 0.35)
"""Range of w_0 [rad/s]."""
UNCERTAIN = ("J_em", "k", "c", "alpha", "b_em", "J_v", "b_w", "f0", "cd2")


@dataclass(frozen=True)
class Driveline:
    """Motor, gear, gap, half-shafts, vehicle; everything but J_em and b_em seen at the wheel."""

    R: float = 9.0
    """Ratio motor : wheel [-]."""
    J_em: float = 0.05
    """Inertia of the motor side, at the motor [kg*m^2]."""
    k: float = 6000.0
    """Stiffness of the half-shafts [N*m/rad]."""
    c: float = 60.0
    """Damping of the half-shafts [N*m*s/rad]."""
    alpha: float = 0.02
    """Half the gap [rad]."""
    b_em: float = 0.01
    """Viscous friction of the motor [N*m*s/rad]."""
    J_v: float = 135.0
    """Vehicle and wheels [kg*m^2]."""
    b_w: float = 0.4
    """Viscous friction of the wheel [N*m*s/rad]."""
    f0: float = 45.0
    """Rolling resistance [N*m]."""
    cd2: float = 0.030
    """Drag over the square of the wheel speed [N*m*s^2/rad^2]."""
    tau_f: float = 0.010
    """Time constant of the wheel-speed sensor [s]."""
    w_0: float = 0.2
    """Wheel speed over which a force that opposes the motion changes its sign [rad/s]."""


NOMINAL = Driveline()


def perturb_driveline(driveline: Driveline, generator: np.random.Generator) -> Driveline:
    """Return the driveline with each uncertain value 5 to 20 % too large or too small.

    How sharply forces change their sign at standstill is drawn as well: no data sheet tells it.
    """
    errors = generator.uniform(SMALLEST_ERROR, LARGEST_ERROR, len(UNCERTAIN))
    signs = generator.choice((-1.0, 1.0), len(UNCERTAIN))
    factors = (1.0 + errors * signs).tolist()
    values = {
        name: getattr(driveline, name) * factor
        for name, factor in zip(UNCERTAIN, factors, strict=True)
    }
    return replace(driveline, **values, w_0=float(generator.uniform(*SHARPNESS)))


def columns_of(drivelines: list[Driveline]) -> dict[str, np.ndarray]:
    """Return every value of the drivelines as an array, (n_drivelines,)."""
    return {
        field.name: np.array([getattr(driveline, field.name) for driveline in drivelines])
        for field in fields(Driveline)
    }
