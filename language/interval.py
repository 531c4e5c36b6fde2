"""Interval: numbers from one to another, and what functions make of them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """All values from `low` to `high`; `known` if they follow from declared ranges alone.

    One that is `broken` does not hold 0, though it may lie on both sides of it.
    """

    low: float = -math.inf
    high: float = math.inf
    known: bool = False
    broken: bool = False

    @property
    def meets_zero(self) -> bool:
        """Tell whether 0 is among the values."""
        return self.low <= 0.0 <= self.high and not self.broken

    def within(self, other: Interval) -> Interval:
        """Return the part that lies in another one too."""
        broken = self.broken or other.broken
        return Interval(max(self.low, other.low), min(self.high, other.high), self.known, broken)

    def joined(self, other: Interval) -> Interval:
        """Return what holds the values of both."""
        known = self.known and other.known
        broken = not (self.meets_zero or other.meets_zero)
        return Interval(min(self.low, other.low), max(self.high, other.high), known, broken)


ANYTHING = Interval()


def corners(left: Interval, right: Interval, join: Callable[[float, float], float]) -> Interval:
    """Return what `join` makes of two intervals, where it is monotonic in both."""
    values = [join(a, b) for a in (left.low, left.high) for b in (right.low, right.high)]
    values = [0.0 if value != value else value for value in values]  # 0 times an infinity
    return Interval(min(values), max(values), left.known and right.known)


def even(base: Interval, exponent: int) -> Interval:
    """Return an even power of an interval."""
    ends = [raised(base.low, exponent), raised(base.high, exponent)]
    return Interval(0.0 if base.low <= 0.0 <= base.high else min(ends), max(ends), base.known)


def raised(value: float, exponent: int) -> float:
    """Return a whole power of a number, infinite where it is too large."""
    try:
        return float(value**exponent)
    except OverflowError:
        return math.inf if value > 0.0 or exponent % 2 == 0 else -math.inf


def image(name: str, parts: list[Interval]) -> Interval:
    """Return what a function makes of intervals; anything where that is not known."""
    first, known = parts[0], all(part.known for part in parts)
    match name:
        case "abs":
            sizes = abs(first.low), abs(first.high)
            low = 0.0 if first.low <= 0.0 <= first.high else min(sizes)
            return Interval(low, max(sizes), known, first.broken)
        case "min" | "max":
            pick = min if name == "min" else max
            return Interval(pick(p.low for p in parts), pick(p.high for p in parts), known)
        case "clip":
            lowest, highest = parts[1].low, parts[2].high
            return Interval(min(max(first.low, lowest), highest), highest, known)
        case "sqrt":
            return Interval(math.sqrt(max(first.low, 0.0)), math.sqrt(max(first.high, 0.0)), known)
        case "exp":
            return Interval(_exponential(first.low), _exponential(first.high), known)
        case "pow":
            base = Interval(max(first.low, 0.0), max(first.high, 0.0), first.known)
            return corners(base, parts[1], _to_power)
        case "log":
            return Interval(_logarithm(first.low), _logarithm(first.high), known)
        case "sin" | "cos" | "tanh" | "sign":
            return Interval(-1.0, 1.0, True)
        case "atan2":
            return Interval(-math.pi, math.pi, True)
        case "floor":
            return Interval(first.low - 1.0, first.high, known)
        case "previous" | "delay":
            return first
        case _:
            return ANYTHING


def _logarithm(value: float) -> float:
    return math.log(min(max(value, sys.float_info.min), sys.float_info.max))


def _to_power(base: float, degree: float) -> float:
    if base <= 0.0 < degree:
        return 0.0
    try:
        power = math.pow(max(base, sys.float_info.min), degree)
    except OverflowError:
        power = math.inf
    return min(max(power, _exponential(-math.inf)), _exponential(math.inf))


def _exponential(value: float) -> float:
    return math.exp(min(max(value, -708.0), 709.0))
