"""Intervals: ranges of reals, and the images of functions over them.

The bounds are computed in double without outward rounding.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """All values from `low` to `high`; `excludes_zero` removes 0 from them.

    `is_certain` is true if the bounds follow from declared ranges alone.
    """

    low: float = -math.inf
    high: float = math.inf
    is_certain: bool = False
    excludes_zero: bool = False

    @property
    def contains_zero(self) -> bool:
        """Return whether 0 is among the values: within the bounds and not excluded."""
        return self.low <= 0.0 <= self.high and not self.excludes_zero

    def intersect(self, other: Interval) -> Interval:
        """Return the intersection with another interval; it keeps the certainty of this one.

        It excludes 0 if one of them does. Without common values `low` is above `high`.
        """
        broken = self.excludes_zero or other.excludes_zero
        return Interval(
            max(self.low, other.low), min(self.high, other.high), self.is_certain, broken
        )

    def hull(self, other: Interval) -> Interval:
        """Return the smallest interval that contains both; it is certain if both are.

        It excludes 0 if neither contains 0.
        """
        known = self.is_certain and other.is_certain
        broken = not (self.contains_zero or other.contains_zero)
        return Interval(min(self.low, other.low), max(self.high, other.high), known, broken)


UNBOUNDED = Interval()
"""The interval of all reals, not certain."""


def image_of_corners(
    left: Interval, right: Interval, operation: Callable[[float, float], float]
) -> Interval:
    """Return the interval of `operation` over two intervals, if it is monotonic in both arguments.

    It is evaluated at the four corners; a NaN (0 times an infinity) counts as 0.
    """
    values = [operation(a, b) for a in (left.low, left.high) for b in (right.low, right.high)]
    values = [0.0 if value != value else value for value in values]  # 0 times an infinity
    return Interval(min(values), max(values), left.is_certain and right.is_certain)


def even_power(base: Interval, exponent: int) -> Interval:
    """Return the interval of an even power, with an exponent of at least 2, over an interval.

    Its lower bound is 0 if 0 lies within the bounds, and the certainty is that of `base`. Overflow
    gives an infinity; 0 is never excluded.
    """
    ends = [power_or_inf(base.low, exponent), power_or_inf(base.high, exponent)]
    return Interval(0.0 if base.low <= 0.0 <= base.high else min(ends), max(ends), base.is_certain)


def inverse_power(base: Interval, exponent: int) -> Interval:
    """Return the interval of 1 / base^exponent, with an exponent of at least 1, over an interval.

    0 must lie outside of the bounds of `base`. Where the power underflows the result is unbounded
    on the side of its sign; the certainty is that of `base`.
    """
    ends = [power_or_inf(base.low, exponent), power_or_inf(base.high, exponent)]
    is_negative = base.high < 0.0 and exponent % 2 == 1
    nearest, farthest = sorted(map(abs, ends))
    low = 1.0 / farthest if farthest else sys.float_info.max
    high = 1.0 / nearest if nearest else math.inf
    bounds = (-high, -low) if is_negative else (low, high)
    return Interval(*bounds, base.is_certain)


def sum_of(left: Interval, right: Interval) -> Interval:
    """Return the interval of a sum; infinite bounds of opposite sign give no bound."""
    low, high = left.low + right.low, left.high + right.high
    return Interval(
        -math.inf if low != low else low,
        math.inf if high != high else high,
        left.is_certain and right.is_certain,
    )


def power_or_inf(value: float, exponent: int) -> float:
    """Return a whole power of a number; on overflow an infinity of the right sign.

    Raises ZeroDivisionError for 0 and a negative exponent.
    """
    try:
        return float(value**exponent)
    except OverflowError:
        return math.inf if value > 0.0 or exponent % 2 == 0 else -math.inf


def function_image(name: str, parts: list[Interval]) -> Interval:
    """Return the interval of a function over the intervals of its arguments.

    It is certain if all arguments are. `sin`, `cos`, `tanh` and `sign` give [-1, 1] and `atan2`
    [-pi, pi], always certain; `floor` starts 1 below its argument; `previous` and `delay` give
    their first argument. Arguments outside of the domain of `sqrt`, `log` and `pow` are clamped to
    it. Any other function, `tan` included, gives UNBOUNDED.
    """
    first, known = parts[0], all(part.is_certain for part in parts)
    match name:
        case "abs":
            sizes = abs(first.low), abs(first.high)
            low = 0.0 if first.low <= 0.0 <= first.high else min(sizes)
            return Interval(low, max(sizes), known, first.excludes_zero)
        case "min" | "max":
            pick = min if name == "min" else max
            return Interval(pick(p.low for p in parts), pick(p.high for p in parts), known)
        case "clip":
            lowest, highest = parts[1].low, parts[2].high
            return Interval(min(max(first.low, lowest), highest), highest, known)
        case "sqrt":
            return Interval(math.sqrt(max(first.low, 0.0)), math.sqrt(max(first.high, 0.0)), known)
        case "exp":
            return Interval(_clamped_exp(first.low), _clamped_exp(first.high), known)
        case "pow":
            base = Interval(max(first.low, 0.0), max(first.high, 0.0), first.is_certain)
            return image_of_corners(base, parts[1], _clamped_pow)
        case "log":
            return Interval(_clamped_log(first.low), _clamped_log(first.high), known)
        case "sin" | "cos" | "tanh" | "sign":
            return Interval(-1.0, 1.0, True)
        case "atan2":
            return Interval(-math.pi, math.pi, True)
        case "floor":
            return Interval(first.low - 1.0, first.high, known)
        case "previous" | "delay":
            return first
        case _:
            return UNBOUNDED


def _clamped_log(value: float) -> float:
    """Return log of a value clamped to the positive normal numbers."""
    return math.log(min(max(value, sys.float_info.min), sys.float_info.max))


def _clamped_pow(base: float, degree: float) -> float:
    """Return the power of a non-negative base, limited to the range of `exp`.

    The result is 0 for base 0 and a degree above 0. A negative base counts as 0.
    """
    if base <= 0.0 < degree:
        return 0.0
    try:
        power = math.pow(max(base, sys.float_info.min), degree)
    except OverflowError:
        power = math.inf
    return min(max(power, _clamped_exp(-math.inf)), _clamped_exp(math.inf))


def _clamped_exp(value: float) -> float:
    """Return exp of a value clamped to [-708, 709]."""
    return math.exp(min(max(value, -708.0), 709.0))
