"""The true values of the driveline's uncertain parameters, off the nominal ones by 5 to 20 %."""

from dataclasses import asdict, dataclass, fields

import numpy as np

RATIO = 9.0
"""Speed of the motor over speed of the wheel, exact [-]."""

TAU_F_S = 0.010
"""Time constant of the wheel-speed sensor's first-order filter, exact [s]."""

LEAST_ERROR, LARGEST_ERROR = 0.05, 0.20
"""Relative distance of a true value from the nominal one [-]."""


@dataclass(frozen=True)
class Base:
    """Uncertain parameters; the defaults are the nominal values that the tool is given."""

    J_em: float = 0.05
    """Inertia of the motor side [kg*m^2]."""
    k: float = 6000.0
    """Stiffness of the half-shafts at the wheel [N*m/rad]."""
    c: float = 60.0
    """Damping of the half-shafts at the wheel [N*m*s/rad]."""
    alpha: float = 0.02
    """Half gap at the wheel [rad]."""
    b_em: float = 0.01
    """Viscous friction of the motor [N*m*s/rad]."""
    J_v: float = 135.0
    """Inertia of the vehicle at the wheel [kg*m^2]."""
    b_w: float = 0.4
    """Viscous friction of the wheel [N*m*s/rad]."""
    f0: float = 45.0
    """Rolling resistance at the wheel [N*m]."""
    cd2: float = 0.030
    """Air drag at the wheel [N*m*s^2/rad^2]."""


NOMINAL = Base()


def draw_base(rng: np.random.Generator) -> Base:
    """Every value off the nominal one by 5 to 20 % up or down, independently."""
    values = {}
    for field in fields(Base):
        error = rng.uniform(LEAST_ERROR, LARGEST_ERROR)
        direction = 1.0 if rng.random() < 0.5 else -1.0
        values[field.name] = getattr(NOMINAL, field.name) * (1.0 + direction * error)
    return Base(**values)


def values(base: Base) -> dict[str, float]:
    """The true values by name, with the exact ones, for the labels."""
    return {"R": RATIO, **asdict(base), "tau_f": TAU_F_S}
