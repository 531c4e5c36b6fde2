"""Kinds: which random specs there are - sampled automata of several flavours, continuous ones."""

from __future__ import annotations

from random import Random

from tests.lockstep.random_specs.continuous_automata import random_continuous_spec
from tests.lockstep.random_specs.sampled_automata import random_sampled_spec
from tests.lockstep.random_specs.spec import Spec


def spec_of(number: int) -> Spec:
    """Return the random spec of a number: always the same."""
    return random_spec(Random(f"luck {number}"), f"chance_{number}")


def random_spec(draw: Random, name: str) -> Spec:
    """Return a random spec: one of four is continuous."""
    return (
        random_continuous_spec(draw, name)
        if draw.random() < 0.25
        else random_sampled_spec(draw, name)
    )
