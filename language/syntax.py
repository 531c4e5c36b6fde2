"""Syntax: an expression as a tree in which every part knows its place."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from fractions import Fraction

from language.problem import Span
from language.units import NO_UNIT, Unit


@dataclass(frozen=True)
class Number:
    """A literal: its exact value in SI and its unit. A bare 0 goes with any dimension."""

    value: Fraction
    unit: Unit
    span: Span

    @property
    def is_bare_zero(self) -> bool:
        """Tell whether this is `0` without a unit."""
        return self.value == 0 and self.unit is NO_UNIT


@dataclass(frozen=True)
class Truth:
    """`true` or `false`."""

    value: bool
    span: Span


@dataclass(frozen=True)
class Name:
    """A name or a dotted path."""

    path: str
    span: Span


@dataclass(frozen=True)
class Negative:
    """Unary minus."""

    operand: Tree
    span: Span


@dataclass(frozen=True)
class Not:
    """Logical negation."""

    operand: Tree
    span: Span


@dataclass(frozen=True)
class Arithmetic:
    """`+ - * /` of two operands."""

    operator: str
    left: Tree
    right: Tree
    span: Span


@dataclass(frozen=True)
class Logic:
    """`and`, `or`; both sides are evaluated."""

    operator: str
    left: Tree
    right: Tree
    span: Span


@dataclass(frozen=True)
class Relation:
    """One relation of two sums."""

    operator: str
    left: Tree
    right: Tree
    span: Span


@dataclass(frozen=True)
class Power:
    """`x^n` with a literal integer n."""

    base: Tree
    exponent: int
    span: Span


@dataclass(frozen=True)
class Choice:
    """`if c then a else b`."""

    condition: Tree
    then: Tree
    other: Tree
    span: Span


@dataclass(frozen=True)
class Application:
    """A function applied to arguments."""

    function: str
    arguments: tuple[Tree, ...]
    span: Span


@dataclass(frozen=True)
class Broken:
    """An expression that could not be read; its problem is reported already."""

    span: Span


Tree = (
    Broken
    | Number
    | Truth
    | Name
    | Negative
    | Not
    | Arithmetic
    | Logic
    | Relation
    | Power
    | Choice
    | Application
)


KEPT = ("previous", "delay")
EDGES = ("rising", "falling")
MEMORY = (*KEPT, *EDGES, "after")
"""Functions with memory."""


def memory_key(tree: Application) -> str:
    """Return the name under which the value of a function with memory is known."""
    return f"{tree.function} {form(tree.arguments)}"


def names(tree: Tree) -> list[Name]:
    """Return every name read in the tree, from left to right."""
    return [part for part in walk(tree) if isinstance(part, Name)]


def walk(tree: Tree) -> list[Tree]:
    """Return every part of the tree, parents first, from left to right."""
    found: list[Tree] = []
    stack = [tree]
    while stack:
        part = stack.pop()
        found.append(part)
        stack.extend(reversed(children(part)))
    return found


def children(tree: Tree) -> tuple[Tree, ...]:
    """Return the direct parts of a tree."""
    match tree:
        case Negative(operand, _) | Not(operand, _):
            return (operand,)
        case Arithmetic(_, left, right, _) | Logic(_, left, right, _) | Relation(_, left, right, _):
            return (left, right)
        case Power(base, _, _):
            return (base,)
        case Choice(condition, then, other, _):
            return (condition, then, other)
        case Application(_, arguments, _):
            return arguments
        case _:
            return ()


def whole_literal(tree: Tree) -> int | None:
    """Return the value of a literal like `2` or `-3`: a whole number without a unit, else None."""
    match tree:
        case Number(value, unit, _) if unit is NO_UNIT and value.denominator == 1:
            return int(value)
        case Negative(Number() as literal, _):
            number = whole_literal(literal)
            return None if number is None else -number
        case _:
            return None


def form(part: object) -> object:
    """Return what a tree says without its places: two trees written alike have equal forms."""
    if isinstance(part, tuple):
        return tuple(form(item) for item in part)
    if dataclasses.is_dataclass(part):
        kept = [item.name for item in dataclasses.fields(part) if item.name != "span"]
        return (type(part).__name__, *(form(getattr(part, name)) for name in kept))
    return part


def depth(tree: Tree) -> int:
    """Return the length of the longest way from a tree to a leaf."""
    level, deepest = [tree], 0
    while level:
        deepest += 1
        level = [child for part in level for child in children(part)]
    return deepest


def is_zero(tree: Tree) -> bool:
    """Tell whether an expression is a bare 0: it goes with any dimension."""
    return isinstance(tree, Number) and tree.is_bare_zero
