"""Kind: what a value is - a quantity, a truth value, a whole number, one name of a list."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from language.expressions.syntax_tree import Name, Relation, SyntaxTree, integer_literal
from language.expressions.units import PURE_NUMBER, Dimension

TypeName = Literal["real", "int", "bool", "enum"]
"""What a declaration says after `type:`."""
TYPE_NAMES = ("real", "int", "bool", "enum")
MAX_INT = 2**31 - 1
"""Whole numbers are held in 32 bits; -2^31 itself stands for what `floor` makes of no number."""


@dataclass(frozen=True)
class IntType:
    """A whole number that lies from `low` to `high`, both included."""

    low: int = -MAX_INT
    high: int = MAX_INT

    def __str__(self) -> str:
        """Return the word of the language."""
        return "int"

    @property
    def fits_int32(self) -> bool:
        """Tell whether it fits 32 bits."""
        return self.low >= -MAX_INT and self.high <= MAX_INT

    def hull(self, other: IntType) -> IntType:
        """Return what holds both."""
        return IntType(min(self.low, other.low), max(self.high, other.high))


@dataclass(frozen=True)
class EnumType:
    """One of some names; its number is its place in the list."""

    values: tuple[str, ...]

    def __str__(self) -> str:
        """Return the names."""
        return f"enum of {', '.join(self.values)}"


BoolType = Literal["truth"]
ExprType = Dimension | BoolType | IntType | EnumType


def int_type_of(operator: str, left: IntType, right: IntType) -> IntType:
    """Return the range of `left operator right` (`+ - *`): the outermost of its corners."""
    if operator == "+":
        return IntType(left.low + right.low, left.high + right.high)
    if operator == "-":
        return IntType(left.low - right.high, left.high - right.low)
    corners = [a * b for a in (left.low, left.high) for b in (right.low, right.high)]
    return IntType(min(corners), max(corners))


def as_real_type(kind: ExprType | None) -> ExprType | None:
    """Return what a kind is in arithmetic of reals: a whole number is a number without a unit."""
    return PURE_NUMBER if isinstance(kind, IntType) else kind


def describe_type(kind: ExprType) -> str:
    """Return a kind in words."""
    if kind == "truth":
        return "true or false"
    if isinstance(kind, EnumType):
        return f"one of {', '.join(kind.values)}"
    return "a whole number" if isinstance(kind, IntType) else "a quantity"


def int_operand_types(
    a: SyntaxTree, a_type: ExprType | None, b: SyntaxTree, b_type: ExprType | None
) -> tuple[IntType, IntType] | None:
    """Return both as whole numbers where one is, and the other is too or is a literal like `2`."""
    if isinstance(a_type, IntType) and isinstance(b_type, IntType):
        return a_type, b_type
    if isinstance(a_type, IntType) and (value := integer_literal(b)) is not None:
        return a_type, IntType(value, value)
    if isinstance(b_type, IntType) and (value := integer_literal(a)) is not None:
        return IntType(value, value), b_type
    return None


def condition_hint(tree: SyntaxTree) -> str:
    """Return what is written for 0 and 1, else how a number becomes a condition."""
    words = {0: "write `false`", 1: "write `true`"}
    number = integer_literal(tree)
    return "compare it: `x > 0`" if number is None else words.get(number, "compare it: `x > 0`")


def comparison_hint(tree: Relation, condition: SyntaxTree) -> str:
    """Return how a condition is written that `tree` compares with 0 or 1, else nothing."""
    number = integer_literal(tree.right if condition is tree.left else tree.left)
    if not isinstance(condition, Name) or number not in (0, 1):
        return ""
    wanted = (number == 1) == (tree.operator == "==")
    return f"it is written `{'' if wanted else 'not '}{condition.path}`"
