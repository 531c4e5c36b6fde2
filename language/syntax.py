"""Syntax: an expression as a tree in which every part knows its place."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from language.problem import Span
from language.units import NO_UNIT, Unit


@dataclass(frozen=True, slots=True)
class Number:
    """A literal: its exact value in SI and its unit. A bare 0 goes with any dimension."""

    value: Fraction
    unit: Unit
    span: Span

    @property
    def is_bare_zero(self) -> bool:
        """Tell whether this is `0` without a unit."""
        return self.value == 0 and self.unit is NO_UNIT


@dataclass(frozen=True, slots=True)
class Truth:
    """`true` or `false`."""

    value: bool
    span: Span


@dataclass(frozen=True, slots=True)
class Name:
    """A name or a dotted path."""

    path: str
    span: Span


@dataclass(frozen=True, slots=True)
class Negative:
    """Unary minus."""

    operand: Tree
    span: Span


@dataclass(frozen=True, slots=True)
class Not:
    """Logical negation."""

    operand: Tree
    span: Span


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """`+ - * /` of two operands."""

    operator: str
    left: Tree
    right: Tree
    span: Span


@dataclass(frozen=True, slots=True)
class Logic:
    """`and`, `or`; both sides are evaluated."""

    operator: str
    left: Tree
    right: Tree
    span: Span


@dataclass(frozen=True, slots=True)
class Relation:
    """One relation of two sums."""

    operator: str
    left: Tree
    right: Tree
    span: Span


@dataclass(frozen=True, slots=True)
class Power:
    """`x^n` with a literal integer n."""

    base: Tree
    exponent: int
    span: Span


@dataclass(frozen=True, slots=True)
class Choice:
    """`if c then a else b`."""

    condition: Tree
    then: Tree
    other: Tree
    span: Span


@dataclass(frozen=True, slots=True)
class Application:
    """A function applied to arguments."""

    function: str
    arguments: tuple[Tree, ...]
    span: Span


@dataclass(frozen=True, slots=True)
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
EDGES = ("rising", "falling", "changed")
TIMES = ("after", "every")
MEMORY = (*KEPT, *EDGES, *TIMES)
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
        parts = PARTS.get(type(part))
        if parts is not None:
            stack += parts(part)[::-1]
    return found


def children(tree: Tree) -> tuple[Tree, ...]:
    """Return the direct parts of a tree."""
    parts = PARTS.get(type(tree))
    return () if parts is None else parts(tree)


PARTS: Mapping[type, Callable[[Any], tuple[Tree, ...]]] = {
    Negative: lambda tree: (tree.operand,),
    Not: lambda tree: (tree.operand,),
    Arithmetic: lambda tree: (tree.left, tree.right),
    Logic: lambda tree: (tree.left, tree.right),
    Relation: lambda tree: (tree.left, tree.right),
    Power: lambda tree: (tree.base,),
    Choice: lambda tree: (tree.condition, tree.then, tree.other),
    Application: lambda tree: tree.arguments,
}
"""The direct parts of each kind of tree that has some."""


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


def alike(first: Tree, second: Tree) -> bool:
    """Tell whether two trees are written alike: equal but for their places."""
    stack = [(first, second)]
    while stack:
        a, b = stack.pop()
        if a is b:
            continue
        parts, others = children(a), children(b)
        if type(a) is not type(b) or said(a) != said(b) or len(parts) != len(others):
            return False
        stack += zip(parts, others, strict=True)
    return True


def said(tree: Tree) -> object:
    """Return what a tree says itself, besides its parts."""
    match tree:
        case Number(value, unit, _):
            return (value.numerator, value.denominator, unit.text)
        case Truth(value, _):
            return value
        case Name(path, _):
            return path
        case Arithmetic(operator, _, _, _) | Logic(operator, _, _, _) | Relation(operator, _, _, _):
            return operator
        case Power(_, exponent, _):
            return exponent
        case Application(function, _, _):
            return function
        case _:
            return None


class Likeness:
    """Numbers trees: two have one number if they are written alike. Each part is read once."""

    def __init__(self) -> None:
        """Know no tree."""
        self.numbers: dict[object, int] = {}
        self.known: dict[int, tuple[Tree, int]] = {}

    def number(self, tree: Tree) -> int:
        """Return the number of a tree."""
        found = self.known.get(id(tree))
        if found is None:
            key = (type(tree), said(tree), *map(self.number, children(tree)))
            found = tree, self.numbers.setdefault(key, len(self.numbers))
            self.known[id(tree)] = found
        return found[1]


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
