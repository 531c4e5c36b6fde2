"""What an effect is: an honest plain name, a place, and numbers drawn for the physics."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.generators.blind_cases.true_parameters import Base

Numbers = dict[str, float]
"""Fields of `Physics` by name."""

Drawing = Callable[[np.random.Generator, Base, float], Numbers]
"""From chance, the true base values and the strength (> 0) to the changed fields."""


@dataclass(frozen=True)
class Effect:
    """One concealed effect; two of the same group cannot act in one case."""

    id: str
    place: str
    draw: Drawing
    group: str = ""


def draw_signed(rng: np.random.Generator, low: float, high: float) -> float:
    """A size between low and high, up or down."""
    size = float(rng.uniform(low, high))
    return size if rng.random() < 0.5 else -size


def draw_angle(rng: np.random.Generator) -> float:
    """An angle [rad]."""
    return float(rng.uniform(0.0, 2.0 * np.pi))
