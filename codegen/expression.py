"""Expression: an expression of a Program as C99, in the same order of operations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

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
    """Where the variables of a Program live in C."""

    def __call__(self, name: str) -> str:
        """Return the C text for a variable or constant."""

    def whole(self, name: str, number: int) -> str:
        """Return a number as it is written beside a whole-number variable: a mode by its name."""


LIBRARY: Mapping[str, str] = {"abs": "fabs", "sqrt": "sqrt", "floor": "floor", "real": "(double)"}
"""Operations that C gives exactly; all others are in ha_math."""
LOGIC: Mapping[str, str] = {"and": "&&", "or": "||"}
CHAINS: Mapping[str, str] = {"+": "+-", "-": "+-", "*": "*/", "/": "*/"}
"""Operators of the left operand that C evaluates first without parentheses: (a + b) - c."""


def c_expression(expr: Expr, place: Place) -> str:
    """Return the C text: parentheses around every operand but those that C takes first anyway."""
    match expr:
        case Value(value):
            return literal(value)
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
            return f"{_operand(left, place)} {operator} {_operand(right, place)}"
        case Select(condition, then, other):
            parts = [_operand(part, place) for part in (condition, then, other)]
            return f"{parts[0]} ? {parts[1]} : {parts[2]}"
        case Call(function, arguments):
            return _call(function, [c_expression(argument, place) for argument in arguments])


def literal(value: float | int | bool) -> str:
    """Return a literal: the shortest decimal that reads back as the same bits (rule R4)."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def _operand(expr: Expr, place: Place) -> str:
    text = c_expression(expr, place)
    simple = isinstance(expr, Ref | Item | Call) or (isinstance(expr, Value) and text[0] != "-")
    return text if simple else f"({text})"


def _binary(whole: Binary, operator: str, left: Expr, right: Expr, place: Place) -> str:
    chained = isinstance(left, Binary) and left.operator in CHAINS.get(whole.operator, "")
    first = c_expression(left, place) if chained else _operand(left, place)
    return f"{first} {operator} {_operand(right, place)}"


def _call(function: str, arguments: list[str]) -> str:
    if function == "real":
        return f"(double)({arguments[0]})"
    name = LIBRARY.get(function, f"ha_{function}")
    return f"{name}({', '.join(arguments)})"
