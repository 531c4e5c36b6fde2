"""Operations: the expressions and operations of a Program, which interpreter and generator share.

Both back ends handle exactly these classes (rule 17b).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from language.ir.number_type import NumberType, round_to_type

BinaryOperator = Literal["+", "-", "*", "/", "and", "or"]
Relation = Literal["<", "<=", ">", ">=", "==", "!="]


@dataclass(frozen=True, slots=True)
class Value:
    """A literal; `exact` is the unrounded value of a real, for one rounding to another type."""

    value: float | int | bool
    exact: Fraction | None = field(default=None, compare=False, repr=False)

    def round_to_type(self, number_type: NumberType) -> Value:
        """Return the literal rounded to a number type.

        It is rounded from `exact` if that is given, else from `value`; the result has no `exact`.
        Whole numbers and truth values are returned unchanged.
        """
        if not isinstance(self.value, float):
            return self
        return Value(round_to_type(self.value if self.exact is None else self.exact, number_type))


@dataclass(frozen=True, slots=True)
class Ref:
    """The value of a variable or constant; `is_integer` is true for a whole number."""

    name: str
    is_integer: bool = False


@dataclass(frozen=True, slots=True)
class Item:
    """One element of an array variable; `is_integer` is true for a whole number."""

    name: str
    index: Expr
    is_integer: bool = False


@dataclass(frozen=True, slots=True)
class Unary:
    """`-` of a real or whole number, or `not` of a truth value."""

    operator: Literal["-", "not"]
    operand: Expr


@dataclass(frozen=True, slots=True)
class Binary:
    """`+ - * /` of two reals or two whole numbers, or `and or` of truth values.

    Both sides are evaluated.
    """

    operator: BinaryOperator
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Compare:
    """A relation of two values; with a NaN it is false, except for `!=`."""

    operator: Relation
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Select:
    """`then` if the condition is true, else `other`; only the selected expression is evaluated."""

    condition: Expr
    then: Expr
    other: Expr


@dataclass(frozen=True, slots=True)
class Call:
    """A call of an elementary operation (abs, sqrt, min, clip, ...) or of a function."""

    function: str
    arguments: tuple[Expr, ...]


Expr = Value | Ref | Item | Unary | Binary | Compare | Select | Call


@dataclass(frozen=True, slots=True)
class Assign:
    """Assignment of a value to a variable; `key` is the key path in the spec."""

    target: str
    value: Expr
    key: str = ""


@dataclass(frozen=True, slots=True)
class Store:
    """Assignment of a value to one element of an array."""

    array: str
    index: Expr
    value: Expr


@dataclass(frozen=True, slots=True)
class Branch:
    """Execution of one of two blocks, depending on a condition."""

    condition: Expr
    then: Block
    other: Block = ()


@dataclass(frozen=True, slots=True)
class Switch:
    """Execution of the block whose case equals the value of a whole-number variable."""

    selector: str
    cases: tuple[tuple[int, Block], ...]


@dataclass(frozen=True, slots=True)
class Loop:
    """Execution of a block a fixed number of times; the variable `index` counts from 0."""

    count: int
    index: str
    body: Block


@dataclass(frozen=True, slots=True)
class Count:
    """Increment of a counter if the condition is true, else its reset to 0 (rule 4b).

    The counter saturates at `limit`.
    """

    timer: str
    condition: Expr
    limit: int
    key: str = ""


@dataclass(frozen=True, slots=True)
class FaultBit:
    """Setting of a fault bit, or clearing of it if `value` is false.

    `signal` names the variable whose range check sets the bit.
    """

    fault: str
    signal: str = ""
    value: bool = True


@dataclass(frozen=True, slots=True)
class RunBlock:
    """Execution of a named block of the Program."""

    block: str


Op = Assign | Store | Branch | Switch | Loop | Count | FaultBit | RunBlock
Block = tuple[Op, ...]


def real(value: float | Fraction) -> Value:
    """Return a real literal in float64, also for a whole number.

    A Fraction is rounded once and also kept as `exact`.
    """
    if isinstance(value, Fraction):
        return Value(round_to_type(value), value)
    return Value(float(value))


def integer(value: int) -> Value:
    """Return a whole-number literal."""
    return Value(int(value))


def add(left: Expr, right: Expr) -> Binary:
    """Return the expression left + right."""
    return Binary("+", left, right)


def subtract(left: Expr, right: Expr) -> Binary:
    """Return the expression left - right."""
    return Binary("-", left, right)


def multiply(left: Expr, right: Expr) -> Binary:
    """Return the expression left * right."""
    return Binary("*", left, right)


def divide(left: Expr, right: Expr) -> Binary:
    """Return the expression left / right."""
    return Binary("/", left, right)


def sum_of(parts: list[Expr]) -> Expr:
    """Return the sum of the parts, added from left to right; the real 0 for an empty list.

    One part is returned as it is.
    """
    if not parts:
        return real(0.0)
    result = parts[0]
    for part in parts[1:]:
        result = add(result, part)
    return result
