"""Expression: an expression of a Program as C99, in the same order of operations (rule C2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from codegen.names import REAL
from language.number import NumberType, decimal
from language.operation import (
    Binary,
    Call,
    Compare,
    Expr,
    Item,
    Ref,
    Select,
    Unary,
    Value,
)


class Place(Protocol):
    """Where the variables of a Program live in C, and the type of its reals."""

    @property
    def number(self) -> NumberType:
        """The type of the reals."""

    def __call__(self, name: str) -> str:
        """Return the C text for a variable or constant."""

    def whole(self, name: str, number: int) -> str:
        """Return a number as it is written beside a whole-number variable: a mode by its name."""

    def is_unsigned(self, name: str) -> bool:
        """Tell whether a variable is a whole number without a sign."""


LIBRARY: Mapping[str, str] = {"abs": "fabs", "sqrt": "sqrt", "floor": "floor"}
"""Operations that C gives exactly; all others are in ha_math."""
SUFFIX: Mapping[NumberType, str] = {"float64": "", "float32": "f"}
"""What C adds to the name of a function for its form in a type: sqrt, sqrtf."""
LOGIC: Mapping[str, str] = {"and": "&&", "or": "||"}
CHAINS: Mapping[str, str] = {
    **{"+": "+-", "-": "+-", "*": "*/", "/": "*/"},
    **{"and": "and", "or": "or"},
}
"""Operators of the left operand that C evaluates first without parentheses: (a + b) - c."""


def c_expression(expr: Expr, place: Place) -> str:
    """Return the C text: parentheses around every operand but those that C takes first anyway."""
    match expr:
        case Value(value):
            return literal(value, place.number)
        case Ref(name):
            return place(name)
        case Item(name, index):
            return f"{place(name)}[{c_expression(index, place)}]"
        case Unary("-", operand):
            return f"-{_operand(operand, place)}"
        case Unary(_, operand):
            return f"!{_operand(operand, place)}"
        case Binary(operator, left, right):
            return _binary(expr, LOGIC.get(operator, operator), left, right, place)
        case Compare(operator, left, right):
            if isinstance(left, Ref) and isinstance(right, Value) and type(right.value) is int:
                return f"{place(left.name)} {operator} {place.whole(left.name, right.value)}"
            if isinstance(left, Ref) and isinstance(right, Ref):
                first, second = _of_one_sign(left.name, right.name, place)
                return f"{first} {operator} {second}"
            return f"{_operand(left, place)} {operator} {_operand(right, place)}"
        case Select(condition, then, other):
            parts = [_operand(part, place) for part in (condition, then, other)]
            return f"{parts[0]} ? {parts[1]} : {parts[2]}"
        case Call(function, arguments):
            texts = [c_expression(argument, place) for argument in arguments]
            return _call(function, texts, place.number)


def literal(value: float | int | bool, number: NumberType) -> str:
    """Return a literal: the shortest decimal that reads back as the same bits (rule C4)."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return repr(value)
    return decimal(value, number) + SUFFIX[number].upper()


def _of_one_sign(left: str, right: str, place: Place) -> list[str]:
    """Return two variables for a comparison: one without a sign as a number with one, beside such
    a one.
    """
    names = (left, right)
    unsigned = [place.is_unsigned(name) for name in names]
    mixed = len(set(unsigned)) == 2
    return [
        f"(int32_t){place(name)}" if mixed and is_unsigned else place(name)
        for name, is_unsigned in zip(names, unsigned, strict=True)
    ]


def _operand(expr: Expr, place: Place) -> str:
    text = c_expression(expr, place)
    simple = isinstance(expr, Ref | Item | Call) or (isinstance(expr, Value) and text[0] != "-")
    return text if simple else f"({text})"


def _binary(whole: Binary, operator: str, left: Expr, right: Expr, place: Place) -> str:
    chained = isinstance(left, Binary) and left.operator in CHAINS.get(whole.operator, "")
    first = c_expression(left, place) if chained else _operand(left, place)
    return f"{first} {operator} {_operand(right, place)}"


def _call(function: str, arguments: list[str], number: NumberType) -> str:
    if function == "real":
        return f"({REAL[number]})({arguments[0]})"
    name = LIBRARY.get(function, f"ha_{function}") + SUFFIX[number]
    return f"{name}({', '.join(arguments)})"
