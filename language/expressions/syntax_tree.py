"""Syntax tree: the nodes of an expression, each with its span, and functions on trees.

Spans are no part of a comparison: two trees are equal if they are written alike. Literals of equal
value in different units differ, and so do `a + b` and `b + a`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, TypeVar

from language.expressions.units import NO_UNIT, Unit
from language.text.diagnostic import Span

NodeT = TypeVar("NodeT")


class _Node:
    """A node of a syntax tree. Its hash covers the tree below it and is computed once."""

    __slots__ = ("_hash",)


def _hash_once(node_class: type[NodeT]) -> type[NodeT]:
    """Return the class with a hash that each node computes at its first use and stores."""
    compute_hash = node_class.__hash__

    def cached_hash(self: Any) -> int:
        try:
            return int(self._hash)
        except AttributeError:
            object.__setattr__(self, "_hash", compute_hash(self))
            return int(self._hash)

    node_class.__hash__ = cached_hash  # type: ignore[method-assign]
    return node_class


@_hash_once
@dataclass(frozen=True, slots=True)
class NumberLiteral(_Node):
    """A number: its exact value in SI and its unit.

    A 0 without a unit is compatible with any dimension.
    """

    value: Fraction
    unit: Unit
    span: Span = field(compare=False, repr=False)

    @property
    def is_bare_zero(self) -> bool:
        """Return whether the literal is `0` without a unit."""
        return self.value == 0 and self.unit is NO_UNIT


@_hash_once
@dataclass(frozen=True, slots=True)
class BoolLiteral(_Node):
    """`true` or `false`."""

    value: bool
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class Name(_Node):
    """A name or a dotted path."""

    path: str
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class Negation(_Node):
    """Unary minus."""

    operand: SyntaxTree
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class Not(_Node):
    """Logical negation."""

    operand: SyntaxTree
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class Arithmetic(_Node):
    """A sum, difference, product or quotient of two operands."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class Logic(_Node):
    """`and` or `or` of two conditions; both sides are evaluated."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span = field(compare=False, repr=False)


NEGATED_RELATION = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
"""The relation that holds of two real numbers where the other one does not."""
FLIPPED_RELATION = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}
"""The relation of two operands that are exchanged."""


@_hash_once
@dataclass(frozen=True, slots=True)
class Relation(_Node):
    """A relation `< <= > >= == !=` of two operands."""

    operator: str
    left: SyntaxTree
    right: SyntaxTree
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class Power(_Node):
    """`x^n` with a literal integer n."""

    base: SyntaxTree
    exponent: int
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class Conditional(_Node):
    """`if condition then ... else ...`."""

    condition: SyntaxTree
    then: SyntaxTree
    other: SyntaxTree
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class FunctionCall(_Node):
    """A function applied to arguments."""

    function: str
    arguments: tuple[SyntaxTree, ...]
    span: Span = field(compare=False, repr=False)


@_hash_once
@dataclass(frozen=True, slots=True)
class ErrorNode(_Node):
    """An expression that could not be parsed; its problem has been reported."""

    span: Span = field(compare=False, repr=False)


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

    It is the function, a blank and the text of its arguments without spans.
    """
    return f"{tree.function} {tree.arguments!r}"


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
