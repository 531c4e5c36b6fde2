"""Shapes: expressions as Python functions over one frame; those of few operands as one.

A call costs more than the operation inside it: so an operand that stands in the frame is read by
its slot, and two operations on three slots are one function. The order of operations is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from language.numerics.evaluate import divide

Frame = list[Any]
ExpressionClosure = Callable[[Frame], Any]
BinaryFactory = Callable[[Any, Any], ExpressionClosure]
FusedFactory = Callable[[Any, int, int], ExpressionClosure]

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
"""Of two slots."""
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
"""Of a slot and an expression."""
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
"""Of an expression and a slot."""
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
"""Of two expressions."""
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
"""(a inner b) outer c, by outer and inner."""
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
"""a outer (b inner c), by outer and inner."""
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
"""As RIGHT, of an expression and two slots."""


def range_test(a: int, low: int, b: int, high: int) -> ExpressionClosure:
    """Return whether one variable is at least another, and one at most another: a range."""
    return lambda v: (v[a] >= v[low]) & (v[b] <= v[high])


def load_slot(slot: int) -> ExpressionClosure:
    """Return what reads a variable."""
    return lambda v: v[slot]


def load_element(slot: int, index: int) -> ExpressionClosure:
    """Return what reads an element whose index never changes."""
    return lambda v: v[slot][index]


def load_item(slot: int, index: ExpressionClosure) -> ExpressionClosure:
    """Return what reads an element of an array."""
    return lambda v: v[slot][index(v)]


def negate(a: ExpressionClosure) -> ExpressionClosure:
    """Return the negative of an expression."""
    return lambda v: -a(v)


def logical_not(a: ExpressionClosure) -> ExpressionClosure:
    """Return what is true where an expression is not."""
    return lambda v: not a(v)


def select(
    condition: ExpressionClosure, if_true: ExpressionClosure, if_false: ExpressionClosure
) -> ExpressionClosure:
    """Return one of two expressions; the other one is not evaluated."""
    return lambda v: if_true(v) if condition(v) else if_false(v)


def call_function(
    function: Callable[..., Any], arguments: Sequence[ExpressionClosure]
) -> ExpressionClosure:
    """Return a function of some expressions."""
    match arguments:
        case [a]:
            return lambda v: function(a(v))
        case [a, b]:
            return lambda v: function(a(v), b(v))
        case [a, b, c]:
            return lambda v: function(a(v), b(v), c(v))
        case _:
            return lambda v: function(*[argument(v) for argument in arguments])
