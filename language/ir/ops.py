"""Operation: expressions and operations of a Program; both back ends walk these and no others."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from language.ir.number_type import NumberType, round_to_type


@dataclass(frozen=True, slots=True)
class Value:
    """A literal; `exact` is what a real was rounded from, so that it is rounded once only."""

    value: float | int | bool
    exact: Fraction | None = field(default=None, compare=False, repr=False)

    def round_to_type(self, number_type: NumberType) -> Value:
        """Return the literal in a number type."""
        if not isinstance(self.value, float):
            return self
        return Value(round_to_type(self.value if self.exact is None else self.exact, number_type))


@dataclass(frozen=True, slots=True)
class Ref:
    """The value of a variable or constant; `whole` if that is a whole number."""

    name: str
    is_integer: bool = False


@dataclass(frozen=True, slots=True)
class Item:
    """One element of an array variable; `whole` if that is a whole number."""

    name: str
    index: Expr
    is_integer: bool = False


@dataclass(frozen=True, slots=True)
class Unary:
    """`-` of a real, `not` of a truth value."""

    operator: Literal["-", "not"]
    operand: Expr


@dataclass(frozen=True, slots=True)
class Binary:
    """`+ - * /` of two reals or two whole numbers, `and or` of truth values (both evaluated)."""

    operator: Literal["+", "-", "*", "/", "and", "or"]
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Compare:
    """A relation; with a NaN it is false, except `!=`."""

    operator: Literal["<", "<=", ">", ">=", "==", "!="]
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Select:
    """`then` if the condition holds, else `other`; only the chosen one is evaluated."""

    condition: Expr
    then: Expr
    other: Expr


@dataclass(frozen=True, slots=True)
class Call:
    """An elementary operation (abs sqrt min max clip sign pow2 floor real whole) or a function."""

    function: str
    arguments: tuple[Expr, ...]


Expr = Value | Ref | Item | Unary | Binary | Compare | Select | Call


@dataclass(frozen=True, slots=True)
class Assign:
    """Set a variable; `key` cites the place in the spec."""

    target: str
    value: Expr
    key: str = ""


@dataclass(frozen=True, slots=True)
class Store:
    """Set one element of an array."""

    array: str
    index: Expr
    value: Expr


@dataclass(frozen=True, slots=True)
class Branch:
    """Run one of two blocks."""

    condition: Expr
    then: Block
    other: Block = ()


@dataclass(frozen=True, slots=True)
class Switch:
    """Run the block of the case that a whole-number variable has."""

    selector: str
    cases: tuple[tuple[int, Block], ...]


@dataclass(frozen=True, slots=True)
class Loop:
    """Run a block a fixed number of times; the index counts from 0."""

    count: int
    index: str
    body: Block


@dataclass(frozen=True, slots=True)
class Count:
    """Count one up to `limit` (saturating) while the condition holds, else back to 0."""

    timer: str
    condition: Expr
    limit: int
    key: str = ""


@dataclass(frozen=True, slots=True)
class FaultBit:
    """Set a fault bit, for the range of a `signal`; or clear one that is not latched."""

    fault: str
    signal: str = ""
    value: bool = True


@dataclass(frozen=True, slots=True)
class RunBlock:
    """Run a named block."""

    block: str


Op = Assign | Store | Branch | Switch | Loop | Count | FaultBit | RunBlock
Block = tuple[Op, ...]


def real(value: float | Fraction) -> Value:
    """Return a real literal; give the exact value where it is known."""
    if isinstance(value, Fraction):
        return Value(round_to_type(value), value)
    return Value(float(value))


def integer(value: int) -> Value:
    """Return a whole-number literal."""
    return Value(int(value))


def add(left: Expr, right: Expr) -> Binary:
    """Return left + right."""
    return Binary("+", left, right)


def subtract(left: Expr, right: Expr) -> Binary:
    """Return left - right."""
    return Binary("-", left, right)


def multiply(left: Expr, right: Expr) -> Binary:
    """Return left * right."""
    return Binary("*", left, right)


def divide(left: Expr, right: Expr) -> Binary:
    """Return left / right."""
    return Binary("/", left, right)


def sum_of(parts: list[Expr]) -> Expr:
    """Return the sum from left to right, 0 for no parts."""
    if not parts:
        return real(0.0)
    result = parts[0]
    for part in parts[1:]:
        result = add(result, part)
    return result
