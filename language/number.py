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
NUMBERS: tuple[NumberType, ...] = ("float64", "float32")
DIGITS: Mapping[NumberType, int] = {"float64": 53, "float32": 24}
"""Significant bits: a rounding is at most 2^-digits of the value."""
LARGEST: Mapping[NumberType, float] = {
    "float64": 1.7976931348623157e308,
    "float32": 3.4028234663852886e38,
}
FLOAT32 = struct.Struct("<f")
MOST_DECIMALS = 9
"""Significant decimals that tell every two float32 apart."""


def rounded(value: Fraction | float, number: NumberType = "float64") -> float:
    """Return the nearest value of a type, ties to even; an infinity where none is near."""
    if isinstance(value, Fraction):
        return _double(value) if number == "float64" else single(_odd(value))
    return ROUNDING[number](value)


def single(value: float) -> float:
    """Return the float32 nearest to a double."""
    try:
        result: float = FLOAT32.unpack(FLOAT32.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return result


ROUNDING: Mapping[NumberType, Callable[[float], float]] = {"float64": float, "float32": single}
"""From the double result of an operation to that of the type."""


def decimal(value: float, number: NumberType) -> str:
    """Return the shortest decimal that reads back as the same bits of the type (rule C4)."""
    if number == "float64" or not math.isfinite(value):
        return repr(value)
    for digits in range(MOST_DECIMALS):
        text = f"{value:.{digits}e}"
        if rounded(Fraction(text), number) == value:
            return repr(float(text))
    raise ValueError(f"{value!r} is not a float32")


def _double(value: Fraction) -> float:
    try:
        return value.numerator / value.denominator
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _odd(value: Fraction) -> float:
    """Return a double beside the value, the odd one of the two: rounding it again is harmless.

    Rounding to odd: Boldo and Melquiond 2008, When double rounding is odd.
    """
    near = _double(value)
    if not math.isfinite(near) or Fraction(near) == value:
        return near
    other = math.nextafter(near, math.inf if Fraction(near) < value else -math.inf)
    is_odd = struct.unpack("<Q", struct.pack("<d", near))[0] % 2 == 1
    return near if is_odd else other
