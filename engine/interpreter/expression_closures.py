"""Expression closures: expressions of a Program as Python functions of one frame.

A Python call costs more than an arithmetic operation. Therefore operands in the frame are read by
their slots, and two operations on three slots are fused to one function. The order of operations is
kept (rule C2).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from language.numerics.evaluate import divide

Frame = list[Any]
"""Values of a Program by slot."""
ExpressionClosure = Callable[[Frame], Any]
"""Function that returns the value of an expression in a frame."""
BinaryFactory = Callable[[Any, Any], ExpressionClosure]
"""Function that returns the closure of an operation on two operands (slots or closures)."""
FusedFactory = Callable[[Any, int, int], ExpressionClosure]
"""Function that returns the closure of two operations: an operand and two slots, or three slots."""

SLOT_SLOT: Mapping[str, BinaryFactory] = {
    "+": lambda a, b: lambda v: v[a] + v[b],
    "-": lambda a, b: lambda v: v[a] - v[b],
    "*": lambda a, b: lambda v: v[a] * v[b],
    "/": lambda a, b: lambda v: v[a] / v[b] if v[b] else divide(v[a], v[b]),
    "and": lambda a, b: lambda v: v[a] & v[b],
    "or": lambda a, b: lambda v: v[a] | v[b],
    "<": lambda a, b: lambda v: v[a] < v[b],
    "<=": lambda a, b: lambda v: v[a] <= v[b],
    ">": lambda a, b: lambda v: v[a] > v[b],
    ">=": lambda a, b: lambda v: v[a] >= v[b],
    "==": lambda a, b: lambda v: v[a] == v[b],
    "!=": lambda a, b: lambda v: v[a] != v[b],
}
"""Operations on two slots."""
SLOT_EXPRESSION: Mapping[str, BinaryFactory] = {
    "+": lambda a, b: lambda v: v[a] + b(v),
    "-": lambda a, b: lambda v: v[a] - b(v),
    "*": lambda a, b: lambda v: v[a] * b(v),
    "/": lambda a, b: lambda v: v[a] / y if (y := b(v)) else divide(v[a], y),
    "and": lambda a, b: lambda v: v[a] & b(v),
    "or": lambda a, b: lambda v: v[a] | b(v),
    "<": lambda a, b: lambda v: v[a] < b(v),
    "<=": lambda a, b: lambda v: v[a] <= b(v),
    ">": lambda a, b: lambda v: v[a] > b(v),
    ">=": lambda a, b: lambda v: v[a] >= b(v),
    "==": lambda a, b: lambda v: v[a] == b(v),
    "!=": lambda a, b: lambda v: v[a] != b(v),
}
"""Operations on a slot and an expression."""
EXPRESSION_SLOT: Mapping[str, BinaryFactory] = {
    "+": lambda a, b: lambda v: a(v) + v[b],
    "-": lambda a, b: lambda v: a(v) - v[b],
    "*": lambda a, b: lambda v: a(v) * v[b],
    "/": lambda a, b: lambda v: a(v) / v[b] if v[b] else divide(a(v), v[b]),
    "and": lambda a, b: lambda v: a(v) & v[b],
    "or": lambda a, b: lambda v: a(v) | v[b],
    "<": lambda a, b: lambda v: a(v) < v[b],
    "<=": lambda a, b: lambda v: a(v) <= v[b],
    ">": lambda a, b: lambda v: a(v) > v[b],
    ">=": lambda a, b: lambda v: a(v) >= v[b],
    "==": lambda a, b: lambda v: a(v) == v[b],
    "!=": lambda a, b: lambda v: a(v) != v[b],
}
"""Operations on an expression and a slot."""
EXPRESSION_EXPRESSION: Mapping[str, BinaryFactory] = {
    "+": lambda a, b: lambda v: a(v) + b(v),
    "-": lambda a, b: lambda v: a(v) - b(v),
    "*": lambda a, b: lambda v: a(v) * b(v),
    "/": lambda a, b: lambda v: a(v) / y if (y := b(v)) else divide(a(v), y),
    "and": lambda a, b: lambda v: a(v) & b(v),
    "or": lambda a, b: lambda v: a(v) | b(v),
    "<": lambda a, b: lambda v: a(v) < b(v),
    "<=": lambda a, b: lambda v: a(v) <= b(v),
    ">": lambda a, b: lambda v: a(v) > b(v),
    ">=": lambda a, b: lambda v: a(v) >= b(v),
    "==": lambda a, b: lambda v: a(v) == b(v),
    "!=": lambda a, b: lambda v: a(v) != b(v),
}
"""Operations on two expressions."""
FUSED_LEFT: Mapping[tuple[str, str], FusedFactory] = {
    ("+", "+"): lambda a, b, c: lambda v: v[a] + v[b] + v[c],
    ("+", "-"): lambda a, b, c: lambda v: v[a] - v[b] + v[c],
    ("+", "*"): lambda a, b, c: lambda v: v[a] * v[b] + v[c],
    ("-", "+"): lambda a, b, c: lambda v: v[a] + v[b] - v[c],
    ("-", "-"): lambda a, b, c: lambda v: v[a] - v[b] - v[c],
    ("-", "*"): lambda a, b, c: lambda v: v[a] * v[b] - v[c],
    ("*", "+"): lambda a, b, c: lambda v: (v[a] + v[b]) * v[c],
    ("*", "-"): lambda a, b, c: lambda v: (v[a] - v[b]) * v[c],
    ("*", "*"): lambda a, b, c: lambda v: v[a] * v[b] * v[c],
}
"""`(a inner b) outer c` on three slots, by outer and inner operator."""
FUSED_RIGHT: Mapping[tuple[str, str], FusedFactory] = {
    ("+", "+"): lambda a, b, c: lambda v: v[a] + (v[b] + v[c]),
    ("+", "-"): lambda a, b, c: lambda v: v[a] + (v[b] - v[c]),
    ("+", "*"): lambda a, b, c: lambda v: v[a] + v[b] * v[c],
    ("-", "+"): lambda a, b, c: lambda v: v[a] - (v[b] + v[c]),
    ("-", "-"): lambda a, b, c: lambda v: v[a] - (v[b] - v[c]),
    ("-", "*"): lambda a, b, c: lambda v: v[a] - v[b] * v[c],
    ("*", "+"): lambda a, b, c: lambda v: v[a] * (v[b] + v[c]),
    ("*", "-"): lambda a, b, c: lambda v: v[a] * (v[b] - v[c]),
    ("*", "*"): lambda a, b, c: lambda v: v[a] * (v[b] * v[c]),
}
"""`a outer (b inner c)` on three slots, by outer and inner operator."""
EXPRESSION_FUSED: Mapping[tuple[str, str], FusedFactory] = {
    ("+", "+"): lambda a, b, c: lambda v: a(v) + (v[b] + v[c]),
    ("+", "-"): lambda a, b, c: lambda v: a(v) + (v[b] - v[c]),
    ("+", "*"): lambda a, b, c: lambda v: a(v) + v[b] * v[c],
    ("-", "+"): lambda a, b, c: lambda v: a(v) - (v[b] + v[c]),
    ("-", "-"): lambda a, b, c: lambda v: a(v) - (v[b] - v[c]),
    ("-", "*"): lambda a, b, c: lambda v: a(v) - v[b] * v[c],
    ("*", "+"): lambda a, b, c: lambda v: a(v) * (v[b] + v[c]),
    ("*", "-"): lambda a, b, c: lambda v: a(v) * (v[b] - v[c]),
    ("*", "*"): lambda a, b, c: lambda v: a(v) * (v[b] * v[c]),
}
"""`a outer (b inner c)` on an expression and two slots, by outer and inner operator."""


def range_test(a: int, low: int, b: int, high: int) -> ExpressionClosure:
    """Return the closure of `v[a] >= v[low] and v[b] <= v[high]`; both sides are evaluated."""
    return lambda v: (v[a] >= v[low]) & (v[b] <= v[high])


def load_slot(slot: int) -> ExpressionClosure:
    """Return the closure that reads a slot."""
    return lambda v: v[slot]


def load_element(slot: int, index: int) -> ExpressionClosure:
    """Return the closure that reads an array element of constant index."""
    return lambda v: v[slot][index]


def load_item(slot: int, index: ExpressionClosure) -> ExpressionClosure:
    """Return the closure that reads an array element of computed index."""
    return lambda v: v[slot][index(v)]


def negate(a: ExpressionClosure) -> ExpressionClosure:
    """Return the closure of the negative of an expression."""
    return lambda v: -a(v)


def logical_not(a: ExpressionClosure) -> ExpressionClosure:
    """Return the closure of the logical negation of an expression."""
    return lambda v: not a(v)


def select(
    condition: ExpressionClosure, if_true: ExpressionClosure, if_false: ExpressionClosure
) -> ExpressionClosure:
    """Return the closure of a conditional expression; only the selected branch is evaluated."""
    return lambda v: if_true(v) if condition(v) else if_false(v)


def call_function(
    function: Callable[..., Any], arguments: Sequence[ExpressionClosure]
) -> ExpressionClosure:
    """Return the closure that calls a function with any number of arguments.

    The arguments are evaluated from left to right.
    """
    match arguments:
        case [a]:
            return lambda v: function(a(v))
        case [a, b]:
            return lambda v: function(a(v), b(v))
        case [a, b, c]:
            return lambda v: function(a(v), b(v), c(v))
        case _:
            return lambda v: function(*[argument(v) for argument in arguments])
