"""The form of the elementary functions and the numbers in them: series, reductions, bases."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction

import mpmath
import pytest

from language.ir.ops import Assign, Binary, Call, Compare, Expr, Ref, Select, Unary, Value
from language.ir.program import unqualified_name
from language.numerics import (
    exp as exponent,
    log as logarithm,
    sin_cos_tanh as elementary,
    tan_atan2 as tangent,
)
from language.numerics.function_table import FUNCTIONS
from language.numerics.payne_hanek import REDUCED_PARTS
from tests.language.numerics.test_sin_cos_tanh import WORST_ANGLE
from tests.language.ulp_errors import polynomial


@pytest.fixture(autouse=True)
def digits() -> Iterator[None]:
    with mpmath.workdps(60):
        yield


def parts(expr: Expr) -> Iterator[Expr]:
    """Yield an expression and all that it contains."""
    yield expr
    match expr:
        case Unary(_, operand):
            yield from parts(operand)
        case Binary(_, left, right) | Compare(_, left, right):
            yield from (*parts(left), *parts(right))
        case Select(condition, then, other):
            yield from (*parts(condition), *parts(then), *parts(other))
        case Call(_, arguments):
            yield from (part for argument in arguments for part in parts(argument))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_form(name: str) -> None:
    """Each local is assigned once and before its use, y last; only what rule C5 allows."""
    callable_names = {
        "abs",
        "pow2",
        *REDUCED_PARTS,
        *list(FUNCTIONS)[: list(FUNCTIONS).index(name)],
    }
    parameters = [f"work.{parameter}" for parameter in FUNCTIONS[name].parameters]
    known = list(parameters)
    for op in FUNCTIONS[name].body:
        assert isinstance(op, Assign)
        for part in parts(op.value):
            assert isinstance(part, (Value, Ref, Unary, Binary, Compare, Select, Call))
            if isinstance(part, Value):
                assert isinstance(part.value, float)
                assert math.isfinite(part.value)
            elif isinstance(part, Ref):
                assert part.name in known
            elif isinstance(part, Call):
                assert part.function in callable_names
        assert op.target not in known
        known.append(op.target)
    assert known[-1] == "work.y"
    assert FUNCTIONS[name].locals == tuple(
        unqualified_name(name) for name in known[len(parameters) :]
    )


def values_of(*literals: Value) -> list[Fraction]:
    return [Fraction(literal.value) for literal in literals]


def test_reduction_constants() -> None:
    """The parts are the constants; the products of the leading parts are exact."""
    first, second, third = values_of(*elementary.HALF_PI_PARTS)
    assert (first * 2**36).denominator == (second * 2**72).denominator == 1
    rest = mpmath.pi / 2 - sum(mpmath.mpf(part.value) for part in elementary.HALF_PI_PARTS)
    assert abs(rest) < mpmath.mpf(2) ** -127
    for part in (first, second):
        assert (part.numerator * 63_662).bit_length() <= 53
    assert abs(third) < Fraction(1, 2**73)
    first, second = values_of(*exponent.LN_2)
    assert (first * 2**42).denominator == 1
    assert (first.numerator * 1023).bit_length() <= 53
    rest = mpmath.log(2) - sum(mpmath.mpf(part.value) for part in exponent.LN_2)
    assert abs(rest) < mpmath.mpf(2) ** -102
    nearest_angle = mpmath.mpf(WORST_ANGLE) - 29 * mpmath.pi / 2
    assert mpmath.mpf(2) ** -61 < abs(nearest_angle) < mpmath.mpf(2) ** -60


def test_series_errors() -> None:
    """The errors of the three polynomials are those that the module states."""
    for i in range(1, 401):
        r = mpmath.pi / 4 * i / 400
        z = r * r
        wrong = mpmath.sin(r) / r - (1 + z * polynomial(elementary.SIN_SERIES, z))
        assert abs(wrong) < mpmath.mpf(2) ** -58
        wrong = mpmath.cos(r) - (1 - z / 2 + z * z * polynomial(elementary.COS_SERIES, z))
        assert abs(wrong) < mpmath.mpf(2) ** -64.1
        for r in (mpmath.log(2) / 2 * i / 400, -mpmath.log(2) / 2 * i / 400):
            e = 1 + r + r * r * polynomial(exponent.EXP_SERIES, r)
            assert abs(e / mpmath.exp(r) - 1) < mpmath.mpf(2) ** -57.9


def test_lambert_coefficients() -> None:
    """x/(1 + z/(3 + ... + z/15)) as x n(z) / d(z), with above = (d - n) / z and below = d."""
    top, bottom = [Fraction(15)], [Fraction(1)]
    for odd in (13, 11, 9, 7, 5, 3, 1):
        size = max(len(top), len(bottom) + 1)
        shifted = [Fraction(0), *bottom] + [Fraction(0)] * (size - len(bottom) - 1)
        padded = top + [Fraction(0)] * (size - len(top))
        top, bottom = [odd * a + b for a, b in zip(padded, shifted, strict=True)], padded
    numerator = bottom + [Fraction(0)] * (len(top) - len(bottom))
    below = [Fraction(c) for c in elementary.LAMBERT_DENOMINATOR]
    above = [Fraction(c) for c in elementary.LAMBERT_NUMERATOR]
    assert [c for c in top if c] == below
    assert [d - n for d, n in zip(top, numerator, strict=True) if d != n] == above
    x = mpmath.mpf(0.625)
    z = x * x
    fraction = polynomial(elementary.LAMBERT_NUMERATOR, z) / polynomial(
        elementary.LAMBERT_DENOMINATOR, z
    )
    assert abs(1 - z * fraction - mpmath.tanh(x) / x) < mpmath.mpf(2) ** -56.9


@pytest.mark.parametrize(
    ("series", "bits"), [(logarithm.LOG_SERIES, 59.4), (logarithm.LOG_SERIES_FLOAT32, 30.2)]
)
def test_logarithm_series_error(series: tuple[float, ...], bits: float) -> None:
    for i in range(1, 401):
        s = (3 - 2 * mpmath.sqrt(2)) * i / 400
        exact = mpmath.log((1 + s) / (1 - s))
        wrong = 2 * s + s * s * s * polynomial(series, s * s) - exact
        assert abs(wrong / exact) < mpmath.mpf(2) ** -bits


def test_arc_tangent_series_error() -> None:
    for i in range(1, 401):
        r = mpmath.mpf(7) / 16 * i / 400
        z = r * r
        wrong = mpmath.atan(r) / r - (1 + z * polynomial(tangent.ATAN_SERIES, z))
        assert abs(wrong) < mpmath.mpf(2) ** -62.3


def test_bases_of_the_arc_tangent() -> None:
    """Each is in two parts: the nearest double and the rest."""
    about = (mpmath.mpf(0), mpmath.atan(mpmath.mpf(0.5)), mpmath.pi / 4)
    turned: dict[str, Callable[[mpmath.mpf], mpmath.mpf]] = {
        "ahead": lambda a: a,
        "behind": lambda a: mpmath.pi - a,
        "steep": lambda a: mpmath.pi / 2 - a,
        "steep behind": lambda a: mpmath.pi / 2 + a,
    }
    for name, made in turned.items():
        for a, (first, rest) in zip(about, tangent.ATAN_BASES[name], strict=True):
            assert first == float(made(a))
            assert abs(made(a) - first - mpmath.mpf(rest)) < mpmath.mpf(2) ** -106
