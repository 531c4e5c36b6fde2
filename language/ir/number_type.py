"""Number: the types that a Program computes in, and rounding to them - once, from the exact value.

A real of either type is a Python float here; one of float32 has at most 24 significant bits. An
operation `+ - * / sqrt` in double, rounded once more, is that of float32: 53 >= 2 * 24 + 2
(Figueroa 1995; rule 17a). numpy is left to the engine.
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
"""Significant bits: a rounding is at most 2^-digits of the value."""
MAX_FINITE: Mapping[NumberType, float] = {
    "float64": 1.7976931348623157e308,
    "float32": 3.4028234663852886e38,
}
FLOAT32_STRUCT = struct.Struct("<f")
MAX_DECIMALS = 9
"""Significant decimals that tell every two float32 apart."""


def round_to_type(value: Fraction | float, number_type: NumberType = "float64") -> float:
    """Return the nearest value of a type, ties to even; an infinity where none is near."""
    if isinstance(value, Fraction):
        return (
            _to_float64(value)
            if number_type == "float64"
            else round_to_float32(_round_to_odd(value))
        )
    return ROUNDING_FUNCTIONS[number_type](value)


def round_to_float32(value: float) -> float:
    """Return the float32 nearest to a double."""
    try:
        result: float = FLOAT32_STRUCT.unpack(FLOAT32_STRUCT.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return result


ROUNDING_FUNCTIONS: Mapping[NumberType, Callable[[float], float]] = {
    "float64": float,
    "float32": round_to_float32,
}
"""From the double result of an operation to that of the type."""


def shortest_decimal(value: float, number_type: NumberType) -> str:
    """Return the shortest decimal that reads back as the same bits of the type (rule C4)."""
    if number_type == "float64" or not math.isfinite(value):
        return repr(value)
    for digits in range(MAX_DECIMALS):
        text = f"{value:.{digits}e}"
        if round_to_type(Fraction(text), number_type) == value:
            return repr(float(text))
    raise ValueError(f"{value!r} is not a float32")


def _to_float64(value: Fraction) -> float:
    try:
        return value.numerator / value.denominator
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _round_to_odd(value: Fraction) -> float:
    """Return a double beside the value, the odd one of the two: rounding it again is harmless.

    Rounding to odd: Boldo and Melquiond 2008, When double rounding is odd.
    """
    near = _to_float64(value)
    if not math.isfinite(near) or Fraction(near) == value:
        return near
    other = math.nextafter(near, math.inf if Fraction(near) < value else -math.inf)
    is_odd = struct.unpack("<Q", struct.pack("<d", near))[0] % 2 == 1
    return near if is_odd else other
