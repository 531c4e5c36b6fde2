"""Syntax tree: the nodes of an expression, each with its span, and functions on trees."""

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
    """A number: its exact value in SI and its unit.

    A 0 without a unit is compatible with any dimension.
    """

    value: Fraction
    unit: Unit
    span: Span

    @property
    def is_bare_zero(self) -> bool:
        """Return whether the literal is `0` without a unit."""
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
    """A sum, difference, product or quotient of two operands."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span


@dataclass(frozen=True, slots=True)
class Logic:
    """`and` or `or` of two conditions; both sides are evaluated."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span


NEGATED_RELATION = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
"""The relation that holds of two real numbers where the other one does not."""
FLIPPED_RELATION = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}
"""The relation of two operands that are exchanged."""


@dataclass(frozen=True, slots=True)
class Relation:
    """A relation `< <= > >= == !=` of two operands."""

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
    """`if condition then ... else ...`."""

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
    """An expression that could not be parsed; its problem has been reported."""

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
"""Functions with memory: their value depends on earlier ticks or instants."""


def memory_key(tree: FunctionCall) -> str:
    """Return the key of a call of a function with memory; calls that are written alike share it.

    It is the function, a blank and the text of `structural_key` of its arguments.
    """
    return f"{tree.function} {structural_key(tree.arguments)}"


def names(tree: SyntaxTree) -> list[Name]:
    """Return every name or path in the tree from left to right, with repetitions.

    The names of functions do not count, arguments of `der` and `in` do.
    """
    return [part for part in walk(tree) if isinstance(part, Name)]


def walk(tree: SyntaxTree) -> list[SyntaxTree]:
    """Return every part of the tree, itself included, parents first, from left to right."""
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
    """Return the direct parts of a tree from left to right; empty for a leaf.

    A choice gives condition, then, other; a power gives its base; a call gives its arguments.
    """
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
"""Function that gives the direct parts, for each type of tree that has parts."""


def integer_literal(tree: SyntaxTree) -> int | None:
    """Return the value of a literal like `2`, `2.0` or `-3`; None for any other tree.

    The number is whole and has no unit.
    """
    match tree:
        case NumberLiteral(value, unit, _) if unit is NO_UNIT and value.denominator == 1:
            return int(value)
        case Negation(NumberLiteral() as literal, _):
            number = integer_literal(literal)
            return None if number is None else -number
        case _:
            return None


def structural_key(part: object) -> object:
    """Return a hashable form of a tree without spans; equal for trees that are written alike.

    It is a tuple of the class name and the forms of the fields. A tuple of trees gives the tuple of
    their forms, any other value itself. Literals of equal value in different units differ.
    """
    if isinstance(part, tuple):
        return tuple(structural_key(item) for item in part)
    if dataclasses.is_dataclass(part):
        field_names = [item.name for item in dataclasses.fields(part) if item.name != "span"]
        return (type(part).__name__, *(structural_key(getattr(part, name)) for name in field_names))
    return part


def is_same_expression(first: SyntaxTree, second: SyntaxTree) -> bool:
    """Return whether two trees are equal except for their spans.

    Literals are equal if value and text of the unit are; `a + b` and `b + a` differ.
    """
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
    """Return the content of the root of a tree without its parts.

    It is the path of a name, the value of a truth value, (numerator, denominator, text of the unit)
    of a number, the operator of a binary operation, the exponent of a power, the function of a
    call; else None.
    """
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
    """A numbering of trees in which trees that are equal except for their spans have one number.

    Trees seen before are found by identity.
    """

    def __init__(self) -> None:
        """Create an empty numbering."""
        self.numbers_by_key: dict[object, int] = {}
        self.numbered_trees: dict[int, tuple[SyntaxTree, int]] = {}

    def number_of(self, tree: SyntaxTree) -> int:
        """Return the number of a tree; a new tree gets the next number, from 0, after its parts."""
        found = self.numbered_trees.get(id(tree))
        if found is None:
            key = (type(tree), node_label(tree), *map(self.number_of, children(tree)))
            found = tree, self.numbers_by_key.setdefault(key, len(self.numbers_by_key))
            self.numbered_trees[id(tree)] = found
        return found[1]


def depth(tree: SyntaxTree) -> int:
    """Return the number of nodes on the longest path from the root of a tree to a leaf.

    A leaf alone has depth 1.
    """
    level, deepest = [tree], 0
    while level:
        deepest += 1
        level = [child for part in level for child in children(part)]
    return deepest


def is_bare_zero(tree: SyntaxTree) -> bool:
    """Return whether an expression is a 0 without a unit; it is compatible with any dimension."""
    return isinstance(tree, NumberLiteral) and tree.is_bare_zero
