"""Number types: float64 and float32 as the types of a Program's reals, and rounding to them.

A real of either type is a Python float here; a float32 has at most 24 significant bits. Each number
is rounded once, from its exact value (rule 17a). An operation `+ - * / sqrt` computed in double and
rounded again equals the float32 operation, because 53 >= 2 * 24 + 2 (Figueroa 1995). This module
does not need numpy.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Literal

NumberType = Literal["float64", "float32"]
NUMBER_TYPES: tuple[NumberType, ...] = ("float64", "float32")
SIGNIFICAND_BITS: Mapping[NumberType, int] = {"float64": 53, "float32": 24}
"""Significant bits p of each type; the relative rounding error is at most 2^-p."""
MAX_FINITE: Mapping[NumberType, float] = {
    "float64": 1.7976931348623157e308,
    "float32": 3.4028234663852886e38,
}
FLOAT32_STRUCT = struct.Struct("<f")
MAX_DECIMALS = 9
"""Number of significant decimals that distinguishes all float32 numbers."""


def round_to_type(value: Fraction | float, number_type: NumberType = "float64") -> float:
    """Return the number of a type nearest to a value, ties to even; overflow gives an infinity.

    A Fraction is rounded once, from its exact value. A float stays as it is for "float64".
    """
    if isinstance(value, Fraction):
        return (
            _to_float64(value)
            if number_type == "float64"
            else round_to_float32(_round_to_odd(value))
        )
    return ROUNDING_FUNCTIONS[number_type](value)


def round_to_float32(value: float) -> float:
    """Return the float32 nearest to a double, ties to even; overflow gives an infinity.

    The result is a Python float. NaN and infinities stay as they are.
    """
    try:
        result: float = FLOAT32_STRUCT.unpack(FLOAT32_STRUCT.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return result


ROUNDING_FUNCTIONS: Mapping[NumberType, Callable[[float], float]] = {
    "float64": float,
    "float32": round_to_float32,
}
"""Function of each type that rounds the double result of an operation."""


def shortest_decimal(value: float, number_type: NumberType) -> str:
    """Return the shortest decimal text that reads back as the same number of the type (rule C4).

    The text is in the notation of repr, also for infinities and NaN. Raises ValueError if
    `number_type` is "float32" and `value` is finite but no float32.
    """
    if number_type == "float64" or not math.isfinite(value):
        return repr(value)
    for digits in range(MAX_DECIMALS):
        text = f"{value:.{digits}e}"
        if round_to_type(Fraction(text), number_type) == value:
            return repr(float(text))
    raise ValueError(f"{value!r} is not a float32")


def _to_float64(value: Fraction) -> float:
    """Return the double nearest to a fraction; overflow gives an infinity."""
    try:
        return value.numerator / value.denominator
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _round_to_odd(value: Fraction) -> float:
    """Return the double equal to the value, or that neighbour of it whose significand is odd.

    Rounding that double again to float32 gives the correctly rounded result (rounding to odd: Boldo
    and Melquiond 2008, "When double rounding is odd").
    """
    near = _to_float64(value)
    if not math.isfinite(near) or Fraction(near) == value:
        return near
    other = math.nextafter(near, math.inf if Fraction(near) < value else -math.inf)
    is_odd = struct.unpack("<Q", struct.pack("<d", near))[0] % 2 == 1
    return near if is_odd else other
