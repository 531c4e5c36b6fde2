"""Effects: their names, places and sizes, and what they change of the physics.

The equations stand in `driveline.c`, beside the fields of `Physics` that they use.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from math import exp, log, pi, sqrt

import numpy as np

Sizes = dict[str, float]
"""Fields of `Physics` by name, in SI units."""
Drawing = Callable[[np.random.Generator, float], Sizes]
"""From a stream of random numbers and the strength (> 0) to the changed fields."""


@dataclass(frozen=True)
class Effect:
    """An effect at a place of the model; two effects of one `group` exclude each other."""

    id: str
    place: str
    draw: Drawing
    group: str = ""


def draw_log(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a value whose logarithm is uniform between those of two limits (> 0)."""
    return exp(rng.uniform(log(low), log(high)))


def _nonlinear(rng: np.random.Generator, strength: float) -> Sizes:
    """A shaft that hardens with the power 2.5 of its twist, or that softens as a tanh."""
    if rng.random() < 0.5:
        return {"hardening": strength * rng.uniform(0.5, 1.5)}
    return {"hardening": -strength * rng.uniform(0.18, 0.32)}


def _mount(rng: np.random.Generator, strength: float) -> Sizes:
    """A housing of 2 to 5 kg*m^2 that oscillates at 8 to 16 Hz on its rubber mounts."""
    inertia = rng.uniform(2.0, 5.0)
    stiffness = inertia * (2.0 * pi * rng.uniform(8.0, 16.0)) ** 2 / strength
    damping = 2.0 * rng.uniform(0.06, 0.2) * sqrt(stiffness * inertia)
    return {"J_h": inertia, "k_h": stiffness, "c_h": damping}


def _tyre(rng: np.random.Generator, strength: float) -> Sizes:
    return {
        "C_t": draw_log(rng, 12e3, 40e3) / strength,
        "relaxation": rng.uniform(0.12, 0.45),
        "J_w": rng.uniform(2.0, 4.0),
    }


MOTOR_INPUT, MOTOR, WHEEL = "inputs.T_em", "flow.w_em", "flow.w_w"
SHAFT, VEHICLE, WHEEL_SENSOR = "elements.half_shaft", "elements.vehicle", "outputs.w_s"
EFFECTS = (
    Effect(
        "actuator_lag",
        MOTOR_INPUT,
        lambda g, s: {"lag": s * draw_log(g, 0.012, 0.05)},
        "actuator",
    ),
    Effect("actuator_delay", MOTOR_INPUT, lambda g, s: {"delay": s * draw_log(g, 0.008, 0.035)}),
    Effect(
        "torque_rate_limit",
        MOTOR_INPUT,
        lambda g, s: {"rate": g.uniform(120.0, 300.0) / s},
        "actuator",
    ),
    Effect("torque_derating", MOTOR_INPUT, lambda g, s: {"power": g.uniform(36e3, 60e3) / s}),
    Effect("torque_drift", MOTOR_INPUT, lambda g, s: {"drift": s * g.uniform(0.05, 0.15)}),
    Effect(
        "torque_ripple",
        MOTOR_INPUT,
        lambda g, s: {
            "ripple": s * draw_log(g, 0.6, 3.0),
            "order": float(g.choice((0.5, 1.0, 2.0))),
        },
    ),
    Effect("coulomb_friction", MOTOR, lambda g, s: {"friction": s * draw_log(g, 0.7, 3.0)}),
    Effect("load_dependent_loss", MOTOR, lambda g, s: {"loss": s * g.uniform(0.025, 0.08)}),
    Effect("road_grade", WHEEL, lambda g, s: {"grade": s * g.uniform(60.0, 200.0)}),
    Effect("stiffness_nonlinear", SHAFT, _nonlinear),
    Effect("stiffness_hysteresis", SHAFT, lambda g, s: {"slip": s * draw_log(g, 25.0, 90.0)}),
    Effect("second_gap", SHAFT, lambda g, s: {"second": s * g.uniform(0.015, 0.03)}),
    Effect(
        "position_dependent_stiffness", SHAFT, lambda g, s: {"unround": s * g.uniform(0.1, 0.25)}
    ),
    Effect("mount_compliance", SHAFT, _mount),
    Effect("tyre_slip", VEHICLE, _tyre),
    Effect("sensor_delay", WHEEL_SENSOR, lambda g, s: {"late": s * draw_log(g, 0.010, 0.045)}),
    Effect(
        "sensor_eccentricity",
        WHEEL_SENSOR,
        lambda g, s: {"eccentric": s * draw_log(g, 2e-3, 12e-3)},
    ),
)
CATALOGUE = {effect.id: effect for effect in EFFECTS}


def parse_effects(words: str) -> list[tuple[str, ...]]:
    """Return the effects of each case of words such as `all:2,none:5,a+b:1`.

    `all` is a case of each effect, `none` one without an effect. Raises ValueError for unknown
    names, for effects that exclude each other, and for counts that are no positive integers.
    """
    cases: list[tuple[str, ...]] = []
    for word in words.split(","):
        name, _, digits = word.strip().partition(":")
        if not digits.isdecimal() or int(digits) < 1:
            raise ValueError(f"{word!r} is not of the form effect:count")
        kinds = [(one,) for one in CATALOGUE] if name == "all" else [_names(name)]
        cases += kinds * int(digits)
    return cases


def _names(word: str) -> tuple[str, ...]:
    """Return the effects of one case, in the order of the catalogue."""
    names = () if word == "none" else tuple(word.split("+"))
    for name in names:
        if name not in CATALOGUE:
            raise ValueError(f"no effect is called {name!r}; known are {', '.join(CATALOGUE)}")
    for one, other in combinations(names, 2):
        group = CATALOGUE[one].group
        if one == other or (group and group == CATALOGUE[other].group):
            raise ValueError(f"{one} and {other} exclude each other")
    return tuple(name for name in CATALOGUE if name in names)
