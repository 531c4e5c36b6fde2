"""Kind: what a value is - a quantity, a truth value, a whole number, one name of a list."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from language.syntax import Name, Relation, Tree, whole_literal
from language.units import NUMBER, Dimension

Type = Literal["real", "int", "bool", "enum"]
"""What a declaration says after `type:`."""
TYPES = ("real", "int", "bool", "enum")
LARGEST_WHOLE = 2**31 - 1
"""Whole numbers are held in 32 bits; -2^31 itself stands for what `floor` makes of no number."""


@dataclass(frozen=True)
class Whole:
    """A whole number that lies from `low` to `high`, both included."""

    low: int = -LARGEST_WHOLE
    high: int = LARGEST_WHOLE

    def __str__(self) -> str:
        """Return the word of the language."""
        return "int"

    @property
    def is_safe(self) -> bool:
        """Tell whether it fits 32 bits."""
        return self.low >= -LARGEST_WHOLE and self.high <= LARGEST_WHOLE

    def joined(self, other: Whole) -> Whole:
        """Return what holds both."""
        return Whole(min(self.low, other.low), max(self.high, other.high))


@dataclass(frozen=True)
class Enumeration:
    """One of some names; its number is its place in the list."""

    values: tuple[str, ...]

    def __str__(self) -> str:
        """Return the names."""
        return f"enum of {', '.join(self.values)}"


Truthful = Literal["truth"]
Kind = Dimension | Truthful | Whole | Enumeration


def combined(operator: str, left: Whole, right: Whole) -> Whole:
    """Return the range of `left operator right` (`+ - *`): the outermost of its corners."""
    if operator == "+":
        return Whole(left.low + right.low, left.high + right.high)
    if operator == "-":
        return Whole(left.low - right.high, left.high - right.low)
    corners = [a * b for a in (left.low, left.high) for b in (right.low, right.high)]
    return Whole(min(corners), max(corners))


def as_real(kind: Kind | None) -> Kind | None:
    """Return what a kind is in arithmetic of reals: a whole number is a number without a unit."""
    return NUMBER if isinstance(kind, Whole) else kind


def said(kind: Kind) -> str:
    """Return a kind in words."""
    if kind == "truth":
        return "true or false"
    if isinstance(kind, Enumeration):
        return f"one of {', '.join(kind.values)}"
    return "a whole number" if isinstance(kind, Whole) else "a quantity"


def wholes_of(
    a: Tree, first: Kind | None, b: Tree, second: Kind | None
) -> tuple[Whole, Whole] | None:
    """Return both as whole numbers where one is, and the other is too or is a literal like `2`."""
    if isinstance(first, Whole) and isinstance(second, Whole):
        return first, second
    if isinstance(first, Whole) and (value := whole_literal(b)) is not None:
        return first, Whole(value, value)
    if isinstance(second, Whole) and (value := whole_literal(a)) is not None:
        return Whole(value, value), second
    return None


def truth_hint(tree: Tree) -> str:
    """Return what is written for 0 and 1, else how a number becomes a condition."""
    words = {0: "write `false`", 1: "write `true`"}
    number = whole_literal(tree)
    return "compare it: `x > 0`" if number is None else words.get(number, "compare it: `x > 0`")


def compared_hint(tree: Relation, condition: Tree) -> str:
    """Return how a condition is written that `tree` compares with 0 or 1, else nothing."""
    number = whole_literal(tree.right if condition is tree.left else tree.left)
    if not isinstance(condition, Name) or number not in (0, 1):
        return ""
    wanted = (number == 1) == (tree.operator == "==")
    return f"it is written `{'' if wanted else 'not '}{condition.path}`"
