"""Payne-Hanek reduction: angles of any size modulo pi/2, by integers (rule C5).

The product of an angle with 2/pi needs only the bits of 2/pi whose product is neither a multiple of
4 nor negligible (Payne and Hanek 1983; Muller 2016, chapter 11). Integers give the same result in
Python and in C, and the C prints this method in ha_math. Smaller angles are reduced by three or
four parts of pi/2 (`reduce_angle`), which is faster.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from language.ir.number_type import MAX_FINITE, NumberType

TWO_OVER_PI_BITS = (
    "a2f9836e4e441529fc2757d1f534ddc0db6295993c439041fe5163abdebbc561b7246e3a42"
    "4dd2e006492eea09d1921cfe1deb1cb129a73ee88235f52ebb4484e99c7026b45f7e413991"
    "d639835339f49c845f8bbdf9283b1ff897ffde05980fef2f118b5a0a6d1f6d367ecf27cb09"
    "b74f463f669e5fea2d7527bac7ebe5f17b3d0739f78a5292ea6bfb5fb11f8d5d0856033046"
)
"""The first 1184 bits of 2/pi behind the point, in hexadecimal digits."""
HALF_PI = 0xC90FDAA22168C235
"""pi/2 * 2^63, rounded."""
ZERO_BITS = 64
"""Zeros in front of TWO_OVER_PI_BITS, so that the window of small angles begins there."""
WINDOW_BITS = 192
"""Number of bits of 2/pi that are multiplied with an angle.

The rest changes the product by less than 2^-137 (float64). No double is nearer to a multiple of
pi/2 than 2^-61, no float32 nearer than 2^-30, so that head + tail is within 2^-61 of the remainder.
"""
TABLE, TABLE_BITS = int(TWO_OVER_PI_BITS, 16), ZERO_BITS + 4 * len(TWO_OVER_PI_BITS)
"""The zeros and the bits of 2/pi as one number, and how many bits these are."""
WORD_BITS = 32
"""Number of bits of a word of the table in C."""


@dataclass(frozen=True)
class AngleFormat:
    """A number type as the reduction uses it.

    A number has `digits` bits behind the leading one, and the biased exponents `lowest` to
    `highest` in the domain of the reduction; `bias` is the biased exponent of 1.
    """

    digits: int
    bias: int
    lowest: int
    highest: int

    @property
    def first_place(self) -> int:
        """The biased exponent whose window begins at the first bit of the table."""
        return self.bias + self.digits + 2 - ZERO_BITS

    @property
    def words(self) -> tuple[int, ...]:
        """The table of C: words of ZERO_BITS zeros and of 2/pi, as far as a window reaches."""
        count = (self.highest - self.first_place) // WORD_BITS + WINDOW_BITS // WORD_BITS + 1
        text = "0" * (ZERO_BITS // 4) + TWO_OVER_PI_BITS
        return tuple(int(text[8 * k : 8 * k + 8], 16) for k in range(count))


ANGLE_FORMATS: Mapping[NumberType, AngleFormat] = {
    "float64": AngleFormat(52, 1023, 1023 + 16, 2046),
    "float32": AngleFormat(23, 127, 127 + 9, 254),
}
"""The domain is |x| >= 2^16 in float64 and |x| >= 2^9 in float32."""
REDUCED_PARTS = ("reduced_quadrant", "reduced_head", "reduced_tail")
"""The operations: the parts of the result of `reduce_far_angle`."""


def reduce_far_angle(x: float, number_type: NumberType) -> tuple[float, float, float]:
    """Return (quadrant 0 1 2 3, head, tail): x [rad] is head + tail beyond a multiple of pi/2.

    |head + tail| <= pi/4, and both have the same sign. The head has the leading bits of the
    remainder, rounded towards 0. x must be in the domain of ANGLE_FORMATS; an infinity gives the
    result of the largest number.
    """
    form = ANGLE_FORMATS[number_type]
    size = form.digits + 1
    part, power = math.frexp(min(abs(x), MAX_FINITE[number_type]))
    mantissa, start = int(math.ldexp(part, size)), power - 1 + form.bias - form.first_place
    window = (TABLE >> (TABLE_BITS - start - WINDOW_BITS)) % 2**WINDOW_BITS
    product = (mantissa * window) % 2**WINDOW_BITS >> (WINDOW_BITS - 128)
    quadrant, fraction = product >> 126, product % 2**126  # in units of 2^-126 quarter turns
    is_above = fraction >= 2**125
    if is_above:
        quadrant, fraction = quadrant + 1, 2**126 - fraction
    zeros = 128 - fraction.bit_length()  # at most 63, see WINDOW_BITS
    angle = ((fraction << zeros >> 64) * HALF_PI) >> 64
    head_place, tail_place = 64 - size, max(0, 64 - 2 * size)
    rest = (angle >> tail_place) % 2 ** (head_place - tail_place)
    head = math.ldexp(angle >> head_place, head_place - 61 - zeros)
    tail = math.ldexp(rest, tail_place - 61 - zeros)
    sign = -1.0 if is_above != (x < 0.0) else 1.0
    turns = -quadrant if x < 0.0 else quadrant
    return float(turns % 4), sign * head, sign * tail


def reduction_operations(number_type: NumberType) -> Mapping[str, Callable[[float], float]]:
    """Return the operations REDUCED_PARTS of a number type; their results are exact in it."""

    def select_part(index: int) -> Callable[[float], float]:
        return lambda x: reduce_far_angle(float(x), number_type)[index]

    return {name: select_part(index) for index, name in enumerate(REDUCED_PARTS)}
