"""Number: one rounding from the exact value, and float32 operations by doubles rounded again."""

from __future__ import annotations

import math
import struct
from decimal import Decimal
from fractions import Fraction

import numpy as np
from hypothesis import example, given, strategies as st

from language.ir.number_type import round_to_float32, round_to_type, shortest_decimal
from language.ir.ops import Binary, Call, Value, real
from language.numerics.evaluate import BINARY_OPERATIONS, evaluate

SINGLES = st.floats(width=32)
LARGEST = (2.0 - 2.0**-23) * 2.0**127
DECIMALS = st.builds(
    "{}.{}e{}".format, st.integers(0, 10**12), st.integers(0, 10**12), st.integers(-60, 40)
)


def bits(value: float) -> bytes:
    return struct.pack("<f", math.nan if value != value else value)


def native(operator: str, a: float, b: float) -> float:
    """Return the operation of the processor."""
    x, y = np.float32(a), np.float32(b)
    with np.errstate(all="ignore"):
        return float({"+": x + y, "-": x - y, "*": x * y, "/": x / y}[operator])


@given(DECIMALS)
@example("1.00000017881393432617187499e0")  # float(text) is a tie between two float32
@example("1.00000017881393432617187501e0")
@example("7.006492321624085e-46")
@example("7.006492321624086e-46")
@example("3.4028235677973366e38")
def test_a_text_becomes_the_nearest_float32_by_one_rounding(text: str) -> None:
    exact = Fraction(Decimal(text))
    value = round_to_type(exact, "float32")
    if math.isinf(value):
        assert exact >= Fraction(LARGEST) + Fraction(2) ** 103
        return
    assert round_to_float32(value) == value
    wrong = abs(Fraction(value) - exact)
    for side in (-math.inf, math.inf):
        with np.errstate(over="ignore"):
            neighbour = float(np.nextafter(np.float32(value), np.float32(side)))
        if math.isfinite(neighbour):
            assert wrong <= abs(Fraction(neighbour) - exact)


def test_two_roundings_would_give_another_float32() -> None:
    text = "1.00000017881393432617187501"
    assert round_to_type(Fraction(text), "float32") == 1.0 + 2.0**-22
    assert round_to_float32(float(text)) == float(np.float32(text)) == 1.0 + 2.0**-22
    below = "1.00000017881393432617187499"
    assert round_to_type(Fraction(below), "float32") == 1.0 + 2.0**-23
    assert round_to_float32(float(below)) == 1.0 + 2.0**-22


@given(st.floats(min_value=0.0, max_value=LARGEST, width=32, exclude_max=True))
def test_a_tie_goes_to_the_even_float32_and_a_hair_more_goes_up(low: float) -> None:
    high = float(np.nextafter(np.float32(low), np.float32(math.inf)))
    middle = (Fraction(low) + Fraction(high)) / 2
    hair = Fraction(1, 10**100)
    even = low if struct.unpack("<I", bits(low))[0] % 2 == 0 else high
    assert round_to_type(middle, "float32") == even
    assert round_to_type(middle - hair, "float32") == low
    assert round_to_type(middle + hair, "float32") == high


@given(SINGLES, SINGLES)
@example(0.0, -0.0)
@example(1.0, 0.0)
@example(-1.0, -0.0)
@example(math.inf, math.inf)
@example(LARGEST, LARGEST)
@example(2.0**-149, 0.5)
@example(2.0**-149, 3.0)
def test_an_operation_of_doubles_rounded_again_is_that_of_float32(a: float, b: float) -> None:
    for operator in "+-*/":
        found = round_to_float32(float(BINARY_OPERATIONS[operator](a, b)))
        assert bits(found) == bits(native(operator, a, b)), operator
    expected = np.sqrt(np.float32(a)) if a >= 0.0 else math.nan
    found = evaluate(Call("sqrt", (Value(a),)), {}, "float32")
    assert bits(float(found)) == bits(float(expected))


def test_every_operation_is_rounded_not_the_whole_expression() -> None:
    """(1 + 2^-24) - 1: in double 2^-24, in float32 the sum is 1 already."""
    expr = Binary("-", Binary("+", real(1.0), real(2.0**-24)), real(1.0))
    assert evaluate(expr, {}) == 2.0**-24
    assert evaluate(expr, {}, "float32") == 0.0


def test_a_literal_is_rounded_from_its_exact_value() -> None:
    text = Fraction("1.00000017881393432617187499")
    assert evaluate(real(text), {}, "float32") == 1.0 + 2.0**-23
    assert real(text).value == float(text)


def test_the_largest_values_overflow_to_infinity() -> None:
    assert round_to_type(Fraction(10) ** 39, "float32") == math.inf
    assert round_to_type(-(Fraction(10) ** 400), "float32") == -math.inf
    assert round_to_type(-(Fraction(10) ** 400)) == -math.inf
    assert round_to_float32(1e39) == math.inf
    assert round_to_float32(LARGEST) == LARGEST


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_the_decimal_of_a_float32_reads_back_and_is_that_of_numpy(value: float) -> None:
    text = shortest_decimal(value, "float32")
    assert round_to_type(Fraction(text), "float32") == value
    assert Fraction(text) == Fraction(np.format_float_scientific(np.float32(value), unique=True))
