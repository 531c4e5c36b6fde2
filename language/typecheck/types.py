"""Types: quantity, truth value, whole number and enumeration as types of expressions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from language.expressions.syntax_tree import Name, Relation, SyntaxTree, integer_literal
from language.expressions.units import PURE_NUMBER, Dimension

TypeName = Literal["real", "int", "bool", "enum"]
"""The word of a declaration after `type:`."""
TYPE_NAMES = ("real", "int", "bool", "enum")
MAX_INT = 2**31 - 1
"""Largest whole number of 32 bits; -2^31 is reserved for `floor` of a NaN."""


@dataclass(frozen=True)
class IntType:
    """A whole number from `low` to `high`, both included."""

    low: int = -MAX_INT
    high: int = MAX_INT

    def __str__(self) -> str:
        """Return the word of the language, `int`."""
        return "int"

    @property
    def fits_int32(self) -> bool:
        """Return whether the range lies within -MAX_INT to MAX_INT."""
        return self.low >= -MAX_INT and self.high <= MAX_INT

    def hull(self, other: IntType) -> IntType:
        """Return the smallest range that contains both."""
        return IntType(min(self.low, other.low), max(self.high, other.high))


@dataclass(frozen=True)
class EnumType:
    """An enumeration; the number of a value is its position in the list, from 0."""

    values: tuple[str, ...]

    def __str__(self) -> str:
        """Return `enum of ` with the names."""
        return f"enum of {', '.join(self.values)}"


BoolType = Literal["truth"]
ExprType = Dimension | BoolType | IntType | EnumType


def int_type_of(operator: str, left: IntType, right: IntType) -> IntType:
    """Return the range of `left operator right` for `+ - *`, from the corners of both ranges.

    Any other operator counts as `*`. The range may be wider than 32 bits.
    """
    if operator == "+":
        return IntType(left.low + right.low, left.high + right.high)
    if operator == "-":
        return IntType(left.low - right.high, left.high - right.low)
    corners = [a * b for a in (left.low, left.high) for b in (right.low, right.high)]
    return IntType(min(corners), max(corners))


def as_real_type(kind: ExprType | None) -> ExprType | None:
    """Return a type as an operand of real arithmetic: a whole number becomes a pure number.

    Other types and None are returned unchanged.
    """
    return PURE_NUMBER if isinstance(kind, IntType) else kind


def describe_type(kind: ExprType) -> str:
    """Return a type in words for messages.

    The texts are "true or false", "one of a, b" (an enumeration), "a whole number", "a quantity".
    """
    if kind == "truth":
        return "true or false"
    if isinstance(kind, EnumType):
        return f"one of {', '.join(kind.values)}"
    return "a whole number" if isinstance(kind, IntType) else "a quantity"


def int_operand_types(
    a: SyntaxTree, a_type: ExprType | None, b: SyntaxTree, b_type: ExprType | None
) -> tuple[IntType, IntType] | None:
    """Return the types of both operands as whole numbers; None if they are not.

    At least one type is a whole number; the other operand may be a literal like `2` or `-3`, whose
    range is its value. Two literals give None.
    """
    if isinstance(a_type, IntType) and isinstance(b_type, IntType):
        return a_type, b_type
    if isinstance(a_type, IntType) and (value := integer_literal(b)) is not None:
        return a_type, IntType(value, value)
    if isinstance(b_type, IntType) and (value := integer_literal(a)) is not None:
        return IntType(value, value), b_type
    return None


def condition_hint(tree: SyntaxTree) -> str:
    """Return the help text for an expression where a condition is needed.

    It is "write `false`" for the literal 0, "write `true`" for 1, else "compare it: `x > 0`".
    """
    words = {0: "write `false`", 1: "write `true`"}
    number = integer_literal(tree)
    return "compare it: `x > 0`" if number is None else words.get(number, "compare it: `x > 0`")


def comparison_hint(tree: Relation, condition: SyntaxTree) -> str:
    """Return the help text for a truth value `condition` that `tree` compares with 0 or 1.

    It is "it is written `a`" or "it is written `not a`" for a relation `==` or `!=`. The text is
    empty if `condition` is not a name or the other side is not the literal 0 or 1.
    """
    number = integer_literal(tree.right if condition is tree.left else tree.left)
    if not isinstance(condition, Name) or number not in (0, 1):
        return ""
    is_affirmed = (number == 1) == (tree.operator == "==")
    return f"it is written `{'' if is_affirmed else 'not '}{condition.path}`"
