"""Reduction of large angles: against pi to 1500 bits, and sin, cos, tan of all magnitudes."""

from __future__ import annotations

import hashlib
import math
import random
import struct
from collections.abc import Iterator

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from language.ir.number_type import MAX_FINITE, NUMBER_TYPES, NumberType, round_to_float32
from language.numerics import float32_constants, sin_cos_tanh
from language.numerics.evaluate import apply_function
from language.numerics.payne_hanek import (
    ANGLE_FORMATS,
    HALF_PI,
    TWO_OVER_PI_BITS,
    WINDOW_BITS,
    ZERO_BITS,
    reduce_far_angle,
)

NEAREST: dict[NumberType, float] = {
    "float64": 6381956970095103.0 * 2.0**797,
    "float32": 16367173.0 * 2.0**72,
}
"""The numbers of each type that are nearest to a multiple of pi/2 (Muller 2016, table 11.1)."""
BOUNDS: dict[NumberType, float] = {
    "float64": sin_cos_tanh.MAX_ANGLE,
    "float32": float32_constants.MAX_ANGLE,
}
LARGEST_ERRORS = {"sin": 0.85, "cos": 0.85, "tan": 2.4}
DIGITS: dict[NumberType, int] = {"float64": 53, "float32": 24}


@pytest.fixture(autouse=True)
def many_bits() -> Iterator[None]:
    with mpmath.workprec(1500):
        yield


def rounded(x: float, number: NumberType) -> float:
    return round_to_float32(x) if number == "float32" else x


def far_angle(draw: random.Random, number: NumberType) -> float:
    form = ANGLE_FORMATS[number]
    power = draw.uniform(form.lowest - form.bias, form.highest - form.bias + 0.99)
    return rounded(draw.choice((-1.0, 1.0)) * 2.0**power, number)


def check_reduction(x: float, number: NumberType) -> None:
    quadrant, head, tail = reduce_far_angle(x, number)
    assert quadrant in (0.0, 1.0, 2.0, 3.0)
    assert (rounded(head, number), rounded(tail, number)) == (head, tail)
    assert abs(tail) <= abs(head) * 2.0 ** (2 - DIGITS[number])
    turns = mpmath.nint(mpmath.mpf(x) * 2 / mpmath.pi)
    exact = mpmath.mpf(x) - turns * mpmath.pi / 2
    assert int(turns) % 4 == quadrant
    lost = 61 if number == "float64" else 46
    assert abs(mpmath.mpf(head) + mpmath.mpf(tail) - exact) < abs(exact) * mpmath.mpf(2) ** -lost


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_remainder_of_pi_over_2(number: NumberType) -> None:
    draw = random.Random(f"far {number}")
    form = ANGLE_FORMATS[number]
    edges = [2.0 ** (form.lowest - form.bias), MAX_FINITE[number], NEAREST[number]]
    for x in (*edges, *(-x for x in edges), *(far_angle(draw, number) for _ in range(1500))):
        check_reduction(x, number)


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.floats(2.0**16, allow_infinity=False))
def test_remainder_of_any_large_double(x: float) -> None:
    with mpmath.workprec(1500):
        check_reduction(x, "float64")


def test_table_reaches_as_far_as_the_largest_number_needs() -> None:
    assert int(TWO_OVER_PI_BITS, 16) == int(mpmath.floor(2 / mpmath.pi * mpmath.mpf(2) ** 1184))
    assert int(mpmath.nint(mpmath.pi / 2 * mpmath.mpf(2) ** 63)) == HALF_PI
    for form in ANGLE_FORMATS.values():
        last = form.highest - form.first_place + WINDOW_BITS
        assert last <= 32 * len(form.words) < last + 64
        assert last <= ZERO_BITS + 4 * len(TWO_OVER_PI_BITS)
        assert form.lowest >= form.first_place


@pytest.mark.parametrize("number", NUMBER_TYPES)
@pytest.mark.parametrize("name", LARGEST_ERRORS)
def test_error_of_large_angles_is_as_stated(name: str, number: NumberType) -> None:
    draw = random.Random(f"{name} {number}")
    bound = BOUNDS[number]
    points = [far_angle(draw, number) for _ in range(250)]
    points += [rounded(draw.uniform(bound, 100.0 * bound), number) for _ in range(250)]
    points += [NEAREST[number], MAX_FINITE[number], rounded(1e22, number)]
    with mpmath.workprec(200):
        assert max(ulp_error(name, x, number) for x in points) < LARGEST_ERRORS[name]


def ulp_error(name: str, x: float, number: NumberType) -> float:
    exact = getattr(mpmath, name)(mpmath.mpf(x))
    result = mpmath.mpf(float(apply_function(name, [x], number)))
    unit = int(mpmath.frexp(abs(exact))[1]) - DIGITS[number]
    return float(abs(mpmath.ldexp(result - exact, -unit)))


def test_angles_of_everyday_are_those_of_numpy() -> None:
    """An engine turns 1000 rad in three seconds."""
    for x in (1001.0, 1002.0, 40000.0, 3.0e6):
        for name, known in (("sin", np.sin), ("cos", np.cos), ("tan", np.tan)):
            single = float(apply_function(name, [x], "float32"))
            assert single == pytest.approx(float(known(x)), rel=3e-7)
            assert float(apply_function(name, [100.0 * x])) == pytest.approx(
                float(known(100.0 * x)), rel=5e-16
            )


@settings(derandomize=True, deadline=None, max_examples=200)
@given(st.floats(allow_nan=False), st.sampled_from(NUMBER_TYPES))
@example(math.inf, "float64")
@example(math.inf, "float32")
def test_large_angles_have_symmetry_and_a_pythagorean_sum(x: float, number: NumberType) -> None:
    x = rounded(x, number)

    def value(name: str, angle: float) -> float:
        return float(apply_function(name, [angle], number))

    for name, sign in (("sin", -1.0), ("cos", 1.0), ("tan", -1.0)):
        assert struct.pack("<d", value(name, -x)) == struct.pack("<d", sign * value(name, x))
    square = value("sin", x) ** 2 + value("cos", x) ** 2
    assert square == pytest.approx(1.0, abs=2.0 ** (3 - DIGITS[number]))


@pytest.mark.parametrize(
    ("number", "digest"), [("float64", "328993cc0593a831"), ("float32", "ffa65c0a9a77c4a4")]
)
def test_bits_up_to_the_bound_do_not_change(number: NumberType, digest: str) -> None:
    """The digest is that of the functions when larger angles were still clamped."""
    draw = random.Random(f"bits {number}")
    found = hashlib.sha256()
    for _ in range(400):
        wide = BOUNDS[number] if draw.random() < 0.7 else 4.0
        x = rounded(draw.uniform(-wide, wide), number)
        for name in LARGEST_ERRORS:
            found.update(struct.pack("<d", float(apply_function(name, [x], number))))
    assert found.hexdigest()[:16] == digest
