"""Syntax: an expression as a tree in which every part knows its place."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from language.expressions.units import NO_UNIT, Unit
from language.text.diagnostic import Span


@dataclass(frozen=True, slots=True)
class NumberLiteral:
    """A literal: its exact value in SI and its unit. A bare 0 goes with any dimension."""

    value: Fraction
    unit: Unit
    span: Span

    @property
    def is_bare_zero(self) -> bool:
        """Tell whether this is `0` without a unit."""
        return self.value == 0 and self.unit is NO_UNIT


@dataclass(frozen=True, slots=True)
class BoolLiteral:
    """`true` or `false`."""

    value: bool
    span: Span


@dataclass(frozen=True, slots=True)
class Name:
    """A name or a dotted path."""

    path: str
    span: Span


@dataclass(frozen=True, slots=True)
class Negation:
    """Unary minus."""

    operand: SyntaxTree
    span: Span


@dataclass(frozen=True, slots=True)
class Not:
    """Logical negation."""

    operand: SyntaxTree
    span: Span


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """`+ - * /` of two operands."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span


@dataclass(frozen=True, slots=True)
class Logic:
    """`and`, `or`; both sides are evaluated."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span


@dataclass(frozen=True, slots=True)
class Relation:
    """One relation of two sums."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span


@dataclass(frozen=True, slots=True)
class Power:
    """`x^n` with a literal integer n."""

    base: SyntaxTree
    exponent: int
    span: Span


@dataclass(frozen=True, slots=True)
class Conditional:
    """`if c then a else b`."""

    condition: SyntaxTree
    then: SyntaxTree
    other: SyntaxTree
    span: Span


@dataclass(frozen=True, slots=True)
class FunctionCall:
    """A function applied to arguments."""

    function: str
    arguments: tuple[SyntaxTree, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class ErrorNode:
    """An expression that could not be read; its problem is reported already."""

    span: Span


SyntaxTree = (
    ErrorNode
    | NumberLiteral
    | BoolLiteral
    | Name
    | Negation
    | Not
    | Arithmetic
    | Logic
    | Relation
    | Power
    | Conditional
    | FunctionCall
)


DELAY_FUNCTIONS = ("previous", "delay")
EDGE_FUNCTIONS = ("rising", "falling", "changed")
TIME_FUNCTIONS = ("after", "every")
MEMORY_FUNCTIONS = (*DELAY_FUNCTIONS, *EDGE_FUNCTIONS, *TIME_FUNCTIONS)
"""Functions with memory."""


def memory_key(tree: FunctionCall) -> str:
    """Return the name under which the value of a function with memory is known."""
    return f"{tree.function} {structural_key(tree.arguments)}"


def names(tree: SyntaxTree) -> list[Name]:
    """Return every name read in the tree, from left to right."""
    return [part for part in walk(tree) if isinstance(part, Name)]


def walk(tree: SyntaxTree) -> list[SyntaxTree]:
    """Return every part of the tree, parents first, from left to right."""
    result: list[SyntaxTree] = []
    stack = [tree]
    while stack:
        part = stack.pop()
        result.append(part)
        parts = CHILDREN_BY_TYPE.get(type(part))
        if parts is not None:
            stack += parts(part)[::-1]
    return result


def children(tree: SyntaxTree) -> tuple[SyntaxTree, ...]:
    """Return the direct parts of a tree."""
    parts = CHILDREN_BY_TYPE.get(type(tree))
    return () if parts is None else parts(tree)


CHILDREN_BY_TYPE: Mapping[type, Callable[[Any], tuple[SyntaxTree, ...]]] = {
    Negation: lambda tree: (tree.operand,),
    Not: lambda tree: (tree.operand,),
    Arithmetic: lambda tree: (tree.left, tree.right),
    Logic: lambda tree: (tree.left, tree.right),
    Relation: lambda tree: (tree.left, tree.right),
    Power: lambda tree: (tree.base,),
    Conditional: lambda tree: (tree.condition, tree.then, tree.other),
    FunctionCall: lambda tree: tree.arguments,
}
"""The direct parts of each kind of tree that has some."""


def integer_literal(tree: SyntaxTree) -> int | None:
    """Return the value of a literal like `2` or `-3`: a whole number without a unit, else None."""
    match tree:
        case NumberLiteral(value, unit, _) if unit is NO_UNIT and value.denominator == 1:
            return int(value)
        case Negation(NumberLiteral() as literal, _):
            number = integer_literal(literal)
            return None if number is None else -number
        case _:
            return None


def structural_key(part: object) -> object:
    """Return what a tree says without its places: two trees written alike have equal forms."""
    if isinstance(part, tuple):
        return tuple(structural_key(item) for item in part)
    if dataclasses.is_dataclass(part):
        field_names = [item.name for item in dataclasses.fields(part) if item.name != "span"]
        return (type(part).__name__, *(structural_key(getattr(part, name)) for name in field_names))
    return part


def is_same_expression(first: SyntaxTree, second: SyntaxTree) -> bool:
    """Tell whether two trees are written alike: equal but for their places."""
    stack = [(first, second)]
    while stack:
        a, b = stack.pop()
        if a is b:
            continue
        parts, others = children(a), children(b)
        if type(a) is not type(b) or node_label(a) != node_label(b) or len(parts) != len(others):
            return False
        stack += zip(parts, others, strict=True)
    return True


def node_label(tree: SyntaxTree) -> object:
    """Return what a tree says itself, besides its parts."""
    match tree:
        case NumberLiteral(value, unit, _):
            return (value.numerator, value.denominator, unit.text)
        case BoolLiteral(value, _):
            return value
        case Name(path, _):
            return path
        case Arithmetic(operator, _, _, _) | Logic(operator, _, _, _) | Relation(operator, _, _, _):
            return operator
        case Power(_, exponent, _):
            return exponent
        case FunctionCall(function, _, _):
            return function
        case _:
            return None


class TreeNumbering:
    """Numbers trees: two have one number if they are written alike. Each part is read once."""

    def __init__(self) -> None:
        """Know no tree."""
        self.numbers_by_key: dict[object, int] = {}
        self.numbered_trees: dict[int, tuple[SyntaxTree, int]] = {}

    def number_of(self, tree: SyntaxTree) -> int:
        """Return the number of a tree."""
        found = self.numbered_trees.get(id(tree))
        if found is None:
            key = (type(tree), node_label(tree), *map(self.number_of, children(tree)))
            found = tree, self.numbers_by_key.setdefault(key, len(self.numbers_by_key))
            self.numbered_trees[id(tree)] = found
        return found[1]


def depth(tree: SyntaxTree) -> int:
    """Return the length of the longest way from a tree to a leaf."""
    level, deepest = [tree], 0
    while level:
        deepest += 1
        level = [child for part in level for child in children(part)]
    return deepest


def is_bare_zero(tree: SyntaxTree) -> bool:
    """Tell whether an expression is a bare 0: it goes with any dimension."""
    return isinstance(tree, NumberLiteral) and tree.is_bare_zero
