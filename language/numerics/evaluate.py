"""Evaluate: the meaning of each elementary operation, and of a constant expression (rule 17b)."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from language.ir.number_type import ROUNDING_FUNCTIONS, NumberType, round_to_float32
from language.ir.ops import Assign, Binary, Call, Compare, Expr, Item, Ref, Select, Unary, Value
from language.numerics.function_table import FUNCTIONS_BY_TYPE
from language.numerics.interpolation import Interpolation

ARITHMETIC: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
"""Of fractions and terms of a solver; floats divide by `evaluate.divide`, as C does."""

RELATIONS: Mapping[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}

Scalar = float | int | bool


def divide(a: float, b: float) -> float:
    """IEEE 754 division: x/0 is an infinity or NaN, never an exception."""
    try:
        return a / b
    except ZeroDivisionError:
        if a == 0.0 or a != a:
            return math.nan
        return math.copysign(math.inf, a) * math.copysign(1.0, b)


def square_root(a: float) -> float:
    """IEEE 754 square root: NaN below zero."""
    return math.sqrt(a) if a >= 0.0 else (a if a == 0.0 else math.nan)


def minimum(a: float, b: float) -> float:
    """Return `b if b < a else a` (rule C7)."""
    return b if b < a else a


def maximum(a: float, b: float) -> float:
    """Return `b if b > a else a` (rule C7)."""
    return b if b > a else a


def clip(x: float, low: float, high: float) -> float:
    """Return x within [low, high]; NaN becomes low (rule C7)."""
    return (x if x < high else high) if x > low else low


def sign(x: float) -> float:
    """Return -1, 0 or 1; 0 for NaN."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


def floor(x: float) -> float:
    """Return the largest whole number not above x; -0.0, infinities and NaN as they are."""
    return x if x == 0.0 or not math.isfinite(x) else float(math.floor(x))


def power_of_two(k: float) -> float:
    """Return 2^k exactly for a whole-valued k from -1022 to 1023, anything else as it is."""
    return math.ldexp(1.0, int(k)) if -1022.0 <= k <= 1023.0 else k


MAX_FLOAT32_INTEGER = 2147483520
"""Largest whole number made of a real: it is one in 32-bit floats too, with 24 bits."""

INTEGER_OF_NAN = -(2**31)
"""What a NaN becomes: outside every range, so that the clip of the target sees it."""


def to_integer(x: float) -> int:
    """Return a whole-valued real as a whole number, the nearest of 32 bits (rule C8)."""
    if -MAX_FLOAT32_INTEGER <= x <= MAX_FLOAT32_INTEGER:
        return int(x)
    return MAX_FLOAT32_INTEGER if x > 0.0 else (-MAX_FLOAT32_INTEGER if x < 0.0 else INTEGER_OF_NAN)


def power_of_two_float32(k: float) -> float:
    """Return 2^k exactly for a whole-valued k from -126 to 127, anything else as it is."""
    return math.ldexp(1.0, int(k)) if -126.0 <= k <= 127.0 else k


FunctionMap = Mapping[str, Callable[..., Scalar]]

ELEMENTARY: FunctionMap = {
    "abs": abs,
    "sqrt": square_root,
    "min": minimum,
    "max": maximum,
    "clip": clip,
    "sign": sign,
    "pow2": power_of_two,
    "real": float,
    "floor": floor,
    "whole": to_integer,
    "lookup": Interpolation(float).lookup,
    "lookup2": Interpolation(float).lookup2,
}
"""In double: exact or rounded once, so that rounding once more gives the result of float32."""

ELEMENTARY_BY_TYPE: Mapping[NumberType, FunctionMap] = {
    "float64": ELEMENTARY,
    "float32": {
        **ELEMENTARY,
        "pow2": power_of_two_float32,
        "lookup": Interpolation(round_to_float32).lookup,
        "lookup2": Interpolation(round_to_float32).lookup2,
    },
}
"""By number type, before the rounding to it."""

BINARY_OPERATIONS: Mapping[str, Callable[[Scalar, Scalar], Scalar]] = {
    **ARITHMETIC,
    "/": divide,
    "and": lambda a, b: bool(a) and bool(b),
    "or": lambda a, b: bool(a) or bool(b),
    **RELATIONS,
}


def evaluate(
    expr: Expr, values: Mapping[str, Scalar], number_type: NumberType = "float64"
) -> Scalar:
    """Return the value of an expression of scalars, each operation rounded to the number type.

    Slow and plain: for check time only.
    """

    def value(part: Expr) -> Scalar:
        return evaluate(part, values, number_type)

    match expr:
        case Value():
            return expr.round_to_type(number_type).value
        case Ref(name):
            return values[name]
        case Unary("-", operand):
            return -value(operand)
        case Unary("not", operand):
            return not value(operand)
        case Binary(operator, left, right) | Compare(operator, left, right):
            return round_if_real(
                BINARY_OPERATIONS[operator](value(left), value(right)), number_type
            )
        case Select(condition, then, other):
            return value(then if value(condition) else other)
        case Call(function, arguments):
            return apply_function(
                function, [value(argument) for argument in arguments], number_type
            )
        case Item() | _:
            raise TypeError(f"not a constant expression: {expr}")


def apply_function(
    function: str, arguments: list[Scalar], number_type: NumberType = "float64"
) -> Scalar:
    """Return the value of an elementary operation or function."""
    if function in ELEMENTARY:
        return round_if_real(ELEMENTARY_BY_TYPE[number_type][function](*arguments), number_type)
    values = tuple(arguments)
    if 0.0 in values:  # a cache takes -0.0 for 0.0
        return _evaluate_function.__wrapped__(function, values, number_type)
    return _evaluate_function(function, values, number_type)


@lru_cache(maxsize=4096)
def _evaluate_function(
    function: str, arguments: tuple[Scalar, ...], number_type: NumberType
) -> Scalar:
    """Return the value of a function that is an operation list; samples come again and again."""
    definition = FUNCTIONS_BY_TYPE[number_type][function]
    names = [f"work.{name}" for name in definition.parameters]
    values: dict[str, Scalar] = dict(zip(names, arguments, strict=True))
    for op in definition.body:
        assert isinstance(op, Assign)
        values[op.target] = evaluate(op.value, values, number_type)
    return values["work.y"]


def round_if_real(value: Scalar, number_type: NumberType) -> Scalar:
    """Return a result rounded to the type if it is a real; truth and whole numbers are exact."""
    return ROUNDING_FUNCTIONS[number_type](value) if isinstance(value, float) else value
