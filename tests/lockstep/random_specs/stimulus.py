"""Stimulus: inputs of each tick, steered to hit guards and to end waits on their last tick."""

from __future__ import annotations

import math
from collections.abc import Iterator
from random import Random

from language.numerics.evaluate import INTEGER_OF_NAN
from tests.lockstep.random_specs.spec import Aim, Spec

SUBNORMAL = 5e-324
SINGLE_SUBNORMAL = 1.5e-45
SPECIALS = (-0.0, 0.0, SUBNORMAL, -SUBNORMAL, 1e-310, SINGLE_SUBNORMAL, -1e-40, 1e-300)
OUTSIDE = (math.nan, math.inf, -math.inf, 1e39, -1e300)
"""What only a range keeps out; the last two are infinite or huge in float32."""

Tick = dict[str, float | int | bool]


def ticks(draw: Random, spec: Spec, count: int, special: bool = True) -> Iterator[Tick]:
    """Yield the inputs of some ticks; without `special` none is outside its range."""
    signals = {aim.name: _signal(draw, aim, spec.waits, special) for aim in spec.aims}
    for _ in range(count):
        yield {f"input.{name}": next(signal) for name, signal in signals.items()}


def _signal(draw: Random, aim: Aim, waits: tuple[int, ...], special: bool) -> Iterator[float | int]:
    while True:
        value = _value(draw, aim, special)
        for _ in range(_ticks_held(draw, waits)):
            is_odd = special and aim.type == "real" and draw.random() < 0.01
            yield draw.choice(OUTSIDE) if is_odd and draw.random() < 0.3 else value


def _ticks_held(draw: Random, waits: tuple[int, ...]) -> int:
    """A wait of n is over when its guard was true for n + 1 ticks: held for n, n + 1, n + 2."""
    if waits and draw.random() < 0.7:
        return max(1, draw.choice(waits) + draw.choice((0, 1, 1, 1, 2)))
    return draw.choice((1, 1, 2, 4, 9, 20))


def _value(draw: Random, aim: Aim, special: bool) -> float | int | bool:
    if aim.type == "truth":
        return draw.random() < 0.5
    if aim.type in ("whole", "enum"):  # in C an enumeration is a byte
        beyond = (int(aim.high) + 1, *((255,) if aim.type == "enum" else (-7, INTEGER_OF_NAN)))
        odd = special and draw.random() < 0.03
        return draw.choice(beyond) if odd else draw.randint(int(aim.low), int(aim.high))
    kind = draw.random()
    if aim.levels and kind < 0.65:
        level = draw.choice(aim.levels)
        near = (level, math.nextafter(level, 9e9), level + 0.25, level - 0.25, level + 3, level - 3)
        return max(aim.low, min(aim.high, draw.choice(near)))
    if kind < 0.75:
        return draw.choice((aim.low, aim.high))
    if kind < 0.87:
        return draw.choice(SPECIALS)
    if special and kind < 0.9:
        return draw.choice((aim.high * 1.5, aim.low - 1.0, *OUTSIDE))
    return draw.uniform(max(aim.low, -9.0), min(aim.high, 9.0))
