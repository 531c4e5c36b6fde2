"""Integer functions: `abs`, `min`, `max` and `clip` of whole numbers (rule C10).

The module has the ranges of their values and their expressions in a Program.
"""

from __future__ import annotations

from collections.abc import Sequence

from language.ir.ops import Compare, Expr, Select, Unary, Value
from language.typecheck.types import IntType


def integer_call_range(function: str, ranges: Sequence[IntType]) -> IntType:
    """Return the range of the value of a function whose arguments lie in the given ranges.

    The function is `abs`, `min` or `max`; any other name counts as `clip` of (value, low, high).
    """
    first = ranges[0]
    match function:
        case "abs":
            low = max(first.low, -first.high, 0)
            return IntType(low, max(abs(first.low), abs(first.high)))
        case "min":
            return IntType(min(r.low for r in ranges), min(r.high for r in ranges))
        case "max":
            return IntType(max(r.low for r in ranges), max(r.high for r in ranges))
        case _:
            _, bottom, top = ranges
            low = min(max(first.low, bottom.low), top.low)
            return IntType(low, max(bottom.high, min(first.high, top.high)))


def lower_integer_call(function: str, parts: Sequence[Expr]) -> Expr:
    """Return the expression of `abs`, `min`, `max` or `clip` of whole numbers as selections.

    `min` and `max` take two arguments and give the first one if both are equal; any other name
    counts as `clip` of (value, low, high), which gives `low` unless the value is above it. The
    order of comparisons is that of the functions of reals (rule C7).
    """
    first = parts[0]
    match function:
        case "abs":
            return Select(Compare("<", first, Value(0)), Unary("-", first), first)
        case "min":
            return Select(Compare("<", parts[1], first), parts[1], first)
        case "max":
            return Select(Compare(">", parts[1], first), parts[1], first)
        case _:
            _, low, high = parts
            return Select(
                Compare(">", first, low), Select(Compare("<", first, high), first, high), low
            )
