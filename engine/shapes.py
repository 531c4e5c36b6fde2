"""Shapes: expressions as Python functions over one frame; those of few operands as one.

A call costs more than the operation inside it: so an operand that stands in the frame is read by
its slot, and two operations on three slots are one function. The order of operations is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from language.evaluate import divide

Frame = list[Any]
Read = Callable[[Frame], Any]
Pair = Callable[[Any, Any], Read]
Triple = Callable[[Any, int, int], Read]

SLOTS: Mapping[str, Pair] = {
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
SLOT_READ: Mapping[str, Pair] = {
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
READ_SLOT: Mapping[str, Pair] = {
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
READS: Mapping[str, Pair] = {
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
LEFT: Mapping[tuple[str, str], Triple] = {
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
RIGHT: Mapping[tuple[str, str], Triple] = {
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
READ_PAIR: Mapping[tuple[str, str], Triple] = {
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


def within(a: int, low: int, b: int, high: int) -> Read:
    """Return whether one variable is at least another, and one at most another: a range."""
    return lambda v: (v[a] >= v[low]) & (v[b] <= v[high])


def of_slot(slot: int) -> Read:
    """Return what reads a variable."""
    return lambda v: v[slot]


def of_element(slot: int, index: int) -> Read:
    """Return what reads an element whose index never changes."""
    return lambda v: v[slot][index]


def of_item(slot: int, index: Read) -> Read:
    """Return what reads an element of an array."""
    return lambda v: v[slot][index(v)]


def negative(a: Read) -> Read:
    """Return the negative of an expression."""
    return lambda v: -a(v)


def opposite(a: Read) -> Read:
    """Return what is true where an expression is not."""
    return lambda v: not a(v)


def selected(condition: Read, then: Read, other: Read) -> Read:
    """Return one of two expressions; the other one is not evaluated."""
    return lambda v: then(v) if condition(v) else other(v)


def called(function: Callable[..., Any], arguments: Sequence[Read]) -> Read:
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
