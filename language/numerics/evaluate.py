"""Evaluation: the meaning of each elementary operation and of an expression (rule 17b)."""

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
from language.numerics.payne_hanek import reduction_operations
from language.typecheck.types import MAX_INT

ARITHMETIC: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
"""Operators for fractions and solver terms; floats use `divide`, as C does."""

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
    """Return a / b by IEEE 754: x/0 is a signed infinity, 0/0 is NaN; no exception is raised."""
    try:
        return a / b
    except ZeroDivisionError:
        if a == 0.0 or a != a:
            return math.nan
        return math.copysign(math.inf, a) * math.copysign(1.0, b)


def square_root(a: float) -> float:
    """Return the IEEE 754 square root: NaN below zero and for NaN, -0.0 for -0.0."""
    return math.sqrt(a) if a >= 0.0 else (a if a == 0.0 else math.nan)


def minimum(a: float, b: float) -> float:
    """Return `b if b < a else a`; a NaN in either gives a (rule C7)."""
    return b if b < a else a


def maximum(a: float, b: float) -> float:
    """Return `b if b > a else a`; a NaN in either gives a (rule C7)."""
    return b if b > a else a


def clip(x: float, low: float, high: float) -> float:
    """Return x limited to [low, high]; a NaN gives low (rule C7)."""
    return (x if x < high else high) if x > low else low


def sign(x: float) -> float:
    """Return -1, 0 or 1 as a float; 0 for NaN."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


def floor(x: float) -> float:
    """Return the largest whole number not above x, as a float.

    The values -0.0, infinities and NaN are returned unchanged.
    """
    return x if x == 0.0 or not math.isfinite(x) else float(math.floor(x))


def power_of_two(k: float) -> float:
    """Return 2^k exactly for a whole-valued k from -1022 to 1023.

    Any k outside of that range, also NaN, is returned unchanged.
    """
    return math.ldexp(1.0, int(k)) if -1022.0 <= k <= 1023.0 else k


INTEGER_OF_NAN = -(2**31)
"""Result of the conversion of a NaN: outside every range, so that a saturation detects it."""


def to_integer(x: float) -> int:
    """Return a real, truncated towards 0, as a whole number of 32 bits (rule C8).

    It is within +-MAX_INT: larger numbers and infinities give that limit. A NaN gives
    INTEGER_OF_NAN.
    """
    if abs(x) < MAX_INT + 1:
        return int(x)
    return MAX_INT if x > 0.0 else (-MAX_INT if x < 0.0 else INTEGER_OF_NAN)


def power_of_two_float32(k: float) -> float:
    """Return 2^k exactly for a whole-valued k from -126 to 127.

    Any k outside of that range, also NaN, is returned unchanged.
    """
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
"""Elementary operations in double; each is exact or rounded once.

One further rounding of a result therefore gives the result in float32.
"""

ELEMENTARY_BY_TYPE: Mapping[NumberType, FunctionMap] = {
    "float64": {**ELEMENTARY, **reduction_operations("float64")},
    "float32": {
        **ELEMENTARY,
        **reduction_operations("float32"),
        "pow2": power_of_two_float32,
        "lookup": Interpolation(round_to_float32).lookup,
        "lookup2": Interpolation(round_to_float32).lookup2,
    },
}
"""Elementary operations of each number type, before the rounding of their result to the type.

To those that specs and Programs call they add those that only elementary functions call.
"""

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
    """Return the value of a scalar expression, each operation rounded to the number type.

    `values` gives the values of names, which are not rounded. Of a choice only the selected side is
    evaluated. Raises KeyError for an unknown name or function and TypeError for an array element.
    The function is slow and is meant for check time.
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
    """Return the value of an operation in ELEMENTARY_BY_TYPE or of a function.

    The result and each operation of a function are rounded to the number type. Results of functions
    are cached, except with an argument of 0. Raises KeyError for an unknown function.
    """
    if function in ELEMENTARY_BY_TYPE[number_type]:
        return round_if_real(ELEMENTARY_BY_TYPE[number_type][function](*arguments), number_type)
    values = tuple(arguments)
    if 0.0 in values:  # the cache does not distinguish -0.0 from 0.0
        return _evaluate_function.__wrapped__(function, values, number_type)
    return _evaluate_function(function, values, number_type)


@lru_cache(maxsize=4096)
def _evaluate_function(
    function: str, arguments: tuple[Scalar, ...], number_type: NumberType
) -> Scalar:
    """Return the value of a function that is an operation list; results are cached."""
    definition = FUNCTIONS_BY_TYPE[number_type][function]
    names = [f"work.{name}" for name in definition.parameters]
    values: dict[str, Scalar] = dict(zip(names, arguments, strict=True))
    for op in definition.body:
        assert isinstance(op, Assign)
        values[op.target] = evaluate(op.value, values, number_type)
    return values["work.y"]


def round_if_real(value: Scalar, number_type: NumberType) -> Scalar:
    """Return a float rounded to the number type; whole numbers and truth values unchanged."""
    return ROUNDING_FUNCTIONS[number_type](value) if isinstance(value, float) else value
