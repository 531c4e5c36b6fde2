"""All effects by name, and what they make of the clean physics."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from tests.generators.blind_cases import inverter, losses, sensor, shaft, tyre
from tests.generators.blind_cases.effect import Effect, Numbers
from tests.generators.blind_cases.physical_parameters import Physics, clean_physics
from tests.generators.blind_cases.true_parameters import Base

CATALOGUE: dict[str, Effect] = {
    effect.id: effect
    for place in (inverter, losses, shaft, tyre, sensor)
    for effect in place.EFFECTS
}


def find_conflict(names: tuple[str, ...]) -> str:
    """Why these effects cannot act in one case, or nothing."""
    for name in names:
        if name not in CATALOGUE:
            return f"no effect is called {name!r}"
    for one, other in combinations(names, 2):
        group = CATALOGUE[one].group
        if one == other:
            return f"{one} twice"
        if group and group == CATALOGUE[other].group:
            return f"{one} and {other} are both of the group {group!r}"
    return ""


def draw_numbers(name: str, key: tuple[int, ...], base: Base, strength: float) -> Numbers:
    """The effect's numbers; they depend on nothing but the key, the name, base and strength."""
    rng = np.random.default_rng([*key, *name.encode()])
    return {
        field: float(value) for field, value in CATALOGUE[name].draw(rng, base, strength).items()
    }


def apply_effects(base: Base, numbers: list[Numbers]) -> Physics:
    """The clean physics with all the effects' numbers."""
    physics = clean_physics(base)
    for of_effect in numbers:
        physics = replace(physics, **of_effect)
    return physics
