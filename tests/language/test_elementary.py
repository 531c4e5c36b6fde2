"""sin, cos, exp and tanh: stated errors against mpmath at 60 digits, symmetry, special values."""

from __future__ import annotations

import math
import random
import re
import struct
from collections.abc import Callable, Iterator
from fractions import Fraction

import mpmath
import pytest
from hypothesis import example, given, settings, strategies as st

from language import elementary
from language.elementary import FUNCTIONS
from language.operation import (
    Assign,
    Binary,
    Call,
    Compare,
    Expr,
    Ref,
    Select,
    Unary,
    Value,
)
from language.program import Function, short

Real = Callable[[float], float]

POINTS = 50_000
BOUNDS = {"sin": (-1e5, 1e5), "cos": (-1e5, 1e5), "exp": (-708.0, 709.0), "tanh": (-20.0, 20.0)}
EXACT = {name: getattr(mpmath, name) for name in FUNCTIONS}
WORST_ANGLE = 45.553093477052
"""Among the doubles up to 1e5 one of the nearest to a multiple of pi/2: 2^-60.5 away."""


@pytest.fixture(autouse=True)
def digits() -> Iterator[None]:
    with mpmath.workdps(60):
        yield


def pow2(k: float) -> float:
    assert k == int(k)  # raises for NaN
    assert -1022 <= k <= 1023
    return math.ldexp(1.0, int(k))


def text(expr: Expr) -> str:
    """Return an expression as Python; other kinds than these have no place in a function."""
    match expr:
        case Value(value):
            return repr(value)
        case Ref(name):
            return short(name)
        case Unary("-", operand):
            return f"(-{text(operand)})"
        case Binary(operator, left, right) | Compare(operator, left, right):
            return f"({text(left)} {operator} {text(right)})"
        case Select(condition, then, other):
            return f"({text(then)} if {text(condition)} else {text(other)})"
        case Call(name, (argument,)):
            return f"{name}({text(argument)})"
    raise AssertionError(expr)


def compiled() -> dict[str, Real]:
    """Return the functions as Python functions."""
    space: dict[str, Real] = {"abs": abs, "pow2": pow2}
    for function in FUNCTIONS.values():
        lines = [f"def {function.name}(x):"]
        for op in function.body:
            assert isinstance(op, Assign)
            lines.append(f"    {short(op.target)} = {text(op.value)}")
        exec("\n".join([*lines, "    return y"]), space)
    return {name: space[name] for name in FUNCTIONS}


PYTHON = compiled()


def stated(function: Function) -> float:
    found = re.fullmatch(r".*; error < ([0-9.]+) ULP", function.about)
    assert found
    return float(found[1])


def error(name: str, x: float) -> float:
    """Return the error at x in ULP of the exact result."""
    exact = EXACT[name](mpmath.mpf(x))
    result = PYTHON[name](x)
    if exact == 0:
        return 0.0 if result == 0.0 else math.inf
    unit = max(int(mpmath.frexp(abs(exact))[1]) - 53, -1074)
    return float(abs(mpmath.ldexp(mpmath.mpf(result) - exact, -unit)))


def bits(x: float) -> bytes:
    return struct.pack("<d", x)


def around(x: float, steps: int = 2) -> list[float]:
    """Return x and its neighbours on both sides, ascending."""
    low, high = [x], [x]
    for _ in range(steps):
        low.append(math.nextafter(low[-1], -math.inf))
        high.append(math.nextafter(high[-1], math.inf))
    return [*reversed(low[1:]), *high]


def anywhere(name: str, draw: random.Random) -> float:
    """Return an argument: anywhere in the domain, of any magnitude, or where errors are large."""
    low, high = BOUNDS[name]
    choice = draw.randrange(4)
    if choice == 0:
        return draw.uniform(low, high)
    if choice == 1:
        size: float = 2.0 ** draw.uniform(-60.0, math.log2(high))
        return max(low, draw.choice((-1.0, 1.0)) * size)
    if name == "exp":
        x = (draw.randrange(-1021, 1022) + 0.5) * math.log(2.0) + draw.uniform(-0.01, 0.01)
        return x if choice == 2 else draw.uniform(-1.0, 1.0)
    if name == "tanh":
        return draw.choice((-1.0, 1.0)) * draw.uniform(*((0.45, 0.625), (0.625, 0.75))[choice - 2])
    if choice == 2:
        return draw.choice(around(draw.randrange(-63_661, 63_662) * (math.pi / 2), 1))
    return (draw.randrange(-63_661, 63_661) + 0.5) * (math.pi / 2) + draw.uniform(-0.02, 0.02)


def specials(name: str) -> list[float]:
    """Return arguments within the domain that have a story."""
    low, high = BOUNDS[name]
    tiny = [0.0, 5e-324, 1e-310, 2.0**-1022, 1e-200, 2.0**-54, 2.0**-27, 2.0**-26]
    some = [0.625, 1.0, WORST_ANGLE, math.log(2.0), 1.5 * math.log(2.0), 19.07, *tiny]
    some += [n * (math.pi / 4) for n in (*range(1, 65), 1000, 4095, 4096, 65535, 127_322, 127_323)]
    near = [y for x in (*some, high) for y in around(x)]
    return [x for y in near for x in (y, -y) if low <= x <= high] + [low]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_error_is_as_stated(name: str) -> None:
    draw = random.Random(f"elementary {name}")
    arguments = [anywhere(name, draw) for _ in range(POINTS)] + specials(name)
    worst = max(arguments, key=lambda x: error(name, x))
    assert error(name, worst) < stated(FUNCTIONS[name]), worst


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.floats(allow_nan=False), st.sampled_from(sorted(FUNCTIONS)))
@example(math.inf, "sin")
@example(-math.inf, "cos")
@example(math.inf, "exp")
@example(-math.inf, "exp")
@example(-math.inf, "tanh")
def test_any_argument(x: float, name: str) -> None:
    low, high = BOUNDS[name]
    clamped = min(max(x, low), high)
    result = PYTHON[name](x)
    assert math.isfinite(result)
    assert bits(result) == bits(PYTHON[name](clamped))
    with mpmath.workdps(60):
        assert error(name, clamped) < stated(FUNCTIONS[name])


@settings(derandomize=True, deadline=None, max_examples=1000)
@given(st.one_of(st.floats(allow_nan=False), st.floats(-1e5, 1e5), st.floats(-20.0, 20.0)))
@example(0.0)
@example(math.inf)
def test_symmetry_bit_for_bit(x: float) -> None:
    assert bits(PYTHON["sin"](-x)) == bits(-PYTHON["sin"](x))
    assert bits(PYTHON["cos"](-x)) == bits(PYTHON["cos"](x))
    assert bits(PYTHON["tanh"](-x)) == bits(-PYTHON["tanh"](x))


def test_symmetry_in_every_quadrant() -> None:
    draw = random.Random("symmetry")
    for x in (draw.uniform(0.0, 1e5) for _ in range(5000)):
        assert bits(PYTHON["sin"](-x)) == bits(-PYTHON["sin"](x))
        assert bits(PYTHON["cos"](-x)) == bits(PYTHON["cos"](x))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_nan_stays_nan(name: str) -> None:
    assert math.isnan(PYTHON[name](math.nan))
    assert math.isnan(PYTHON[name](-math.nan))


def test_exact_values() -> None:
    for zero in (0.0, -0.0):
        assert bits(PYTHON["sin"](zero)) == bits(zero)
        assert bits(PYTHON["tanh"](zero)) == bits(zero)
        assert bits(PYTHON["cos"](zero)) == bits(1.0)
        assert bits(PYTHON["exp"](zero)) == bits(1.0)
    for x in (5e-324, 2.0**-1022, 1e-300, 2.0**-55):
        assert PYTHON["sin"](x) == PYTHON["tanh"](x) == x
        assert PYTHON["exp"](-x) == PYTHON["cos"](x) == 1.0
    for x in (19.07, 20.0, 1e3, 1.7e308, math.inf):
        assert PYTHON["tanh"](x) == 1.0
        assert PYTHON["tanh"](-x) == -1.0
    assert PYTHON["tanh"](19.06) < 1.0


def test_monotone_near_the_clamps() -> None:
    def values(name: str, x: float) -> list[float]:
        return [PYTHON[name](y) for y in around(x, 400)]

    for x in BOUNDS["exp"]:
        assert values("exp", x) == sorted(values("exp", x))
    for x in (19.06154, 20.0):
        assert values("tanh", x) == sorted(values("tanh", x))
        assert values("tanh", -x) == sorted(values("tanh", -x))
    # sin and cos of 1e5 + t: both slopes there, -0.9994 and -0.0357, are far from 0.
    for name in ("sin", "cos"):
        assert values(name, 1e5) == sorted(values(name, 1e5), reverse=True)


def test_within_minus_one_and_one() -> None:
    for n in range(-63_661, 63_662, 7):
        for x in around(n * (math.pi / 2), 1):
            assert abs(PYTHON["sin"](x)) <= 1.0
            assert abs(PYTHON["cos"](x)) <= 1.0


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
    """Each local is assigned once and before its use, y last; only what rule R5 allows."""
    callable_names = {"abs", "pow2", *list(FUNCTIONS)[: list(FUNCTIONS).index(name)]}
    known = ["work.x"]
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
    assert FUNCTIONS[name].locals == tuple(short(name) for name in known[1:])


def values_of(*literals: Value) -> list[Fraction]:
    return [Fraction(literal.value) for literal in literals]


def test_reduction_constants() -> None:
    """The parts are the constants; the products of the leading parts are exact."""
    first, second, third = values_of(*elementary.QUARTER)
    assert (first * 2**36).denominator == (second * 2**72).denominator == 1
    rest = mpmath.pi / 2 - sum(mpmath.mpf(part.value) for part in elementary.QUARTER)
    assert abs(rest) < mpmath.mpf(2) ** -127
    for part in (first, second):
        assert (part.numerator * 63_662).bit_length() <= 53
    assert abs(third) < Fraction(1, 2**73)
    first, second = values_of(*elementary.LN_2)
    assert (first * 2**42).denominator == 1
    assert (first.numerator * 1023).bit_length() <= 53
    rest = mpmath.log(2) - sum(mpmath.mpf(part.value) for part in elementary.LN_2)
    assert abs(rest) < mpmath.mpf(2) ** -102
    nearest_angle = mpmath.mpf(WORST_ANGLE) - 29 * mpmath.pi / 2
    assert mpmath.mpf(2) ** -61 < abs(nearest_angle) < mpmath.mpf(2) ** -60


def polynomial(coefficients: tuple[float, ...], x: mpmath.mpf) -> mpmath.mpf:
    return sum(c * x**power for power, c in enumerate(coefficients))


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
            e = 1 + r + r * r * polynomial(elementary.EXP_SERIES, r)
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
    below = [Fraction(c) for c in elementary.LAMBERT_BELOW]
    above = [Fraction(c) for c in elementary.LAMBERT_ABOVE]
    assert [c for c in top if c] == below
    assert [d - n for d, n in zip(top, numerator, strict=True) if d != n] == above
    x = mpmath.mpf(0.625)
    z = x * x
    fraction = polynomial(elementary.LAMBERT_ABOVE, z) / polynomial(elementary.LAMBERT_BELOW, z)
    assert abs(1 - z * fraction - mpmath.tanh(x) / x) < mpmath.mpf(2) ** -56.9
