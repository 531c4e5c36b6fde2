"""sin, cos, tan, exp, log, tanh: errors against mpmath at 60 digits, symmetry, special values."""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Iterator

import mpmath
import pytest
from hypothesis import example, given, settings, strategies as st

from language.numerics.function_table import FUNCTIONS
from language.numerics.sin_cos_tanh import MAX_ANGLE
from tests.language.ulp_errors import PYTHON, bits, neighbours_of, stated_error, ulp_error

POINTS = 50_000
BOUNDS = {
    **dict.fromkeys(("sin", "cos", "tan"), (-sys.float_info.max, sys.float_info.max)),
    "exp": (-708.0, 709.0),
    "tanh": (-20.0, 20.0),
    "log": (sys.float_info.min, sys.float_info.max),
}
ONE = [name for name, function in FUNCTIONS.items() if len(function.parameters) == 1]
WORST_ANGLE = 45.553093477052
"""Among the doubles up to 1e5 one of the nearest to a multiple of pi/2: 2^-60.5 away."""


@pytest.fixture(autouse=True)
def digits() -> Iterator[None]:
    with mpmath.workdps(60):
        yield


def anywhere(name: str, draw: random.Random) -> float:
    """Return an argument: anywhere in the domain, of any magnitude, or where errors are large."""
    low, high = BOUNDS[name]
    choice = draw.randrange(4)
    if name in ("sin", "cos", "tan"):
        if draw.random() < 0.1:
            return draw.choice((-1.0, 1.0)) * math.exp2(draw.uniform(16.0, 1023.9))
        low, high = -MAX_ANGLE, MAX_ANGLE
    if name == "log":
        power = draw.uniform(-1022.0, 1023.9) if choice else draw.uniform(-0.6, 0.6)
        near = neighbours_of(math.ldexp(1.0, draw.randrange(-1021, 1024)), 3)
        return math.exp2(power) if choice < 3 else draw.choice(near)
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
        return draw.choice(neighbours_of(draw.randrange(-63_661, 63_662) * (math.pi / 2), 1))
    return (draw.randrange(-63_661, 63_661) + 0.5) * (math.pi / 2) + draw.uniform(-0.02, 0.02)


def specials(name: str) -> list[float]:
    """Return arguments within the domain that have a story."""
    low, high = BOUNDS[name]
    tiny = [0.0, 5e-324, 1e-310, 2.0**-1022, 1e-200, 2.0**-54, 2.0**-27, 2.0**-26]
    some = [0.625, 1.0, WORST_ANGLE, math.log(2.0), 1.5 * math.log(2.0), 19.07, *tiny]
    some += [n * (math.pi / 4) for n in (*range(1, 65), 1000, 4095, 4096, 65535, 127_322, 127_323)]
    near = [y for x in (*some, high) for y in neighbours_of(x)]
    return [x for y in near for x in (y, -y) if low <= x <= high] + [low]


@pytest.mark.long
@pytest.mark.parametrize("name", ONE)
def test_error_is_as_stated(name: str) -> None:
    draw = random.Random(f"elementary {name}")
    arguments = [anywhere(name, draw) for _ in range(POINTS)] + specials(name)
    worst = max(arguments, key=lambda x: ulp_error(name, x))
    assert ulp_error(name, worst) < stated_error(FUNCTIONS[name]), worst


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.floats(allow_nan=False), st.sampled_from(sorted(ONE)))
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
        assert ulp_error(name, clamped) < stated_error(FUNCTIONS[name])


@settings(derandomize=True, deadline=None, max_examples=1000)
@given(st.one_of(st.floats(allow_nan=False), st.floats(-1e5, 1e5), st.floats(-20.0, 20.0)))
@example(0.0)
@example(math.inf)
def test_symmetry_bit_for_bit(x: float) -> None:
    assert bits(PYTHON["sin"](-x)) == bits(-PYTHON["sin"](x))
    assert bits(PYTHON["cos"](-x)) == bits(PYTHON["cos"](x))
    assert bits(PYTHON["tan"](-x)) == bits(-PYTHON["tan"](x))
    assert bits(PYTHON["tanh"](-x)) == bits(-PYTHON["tanh"](x))


def test_symmetry_in_every_quadrant() -> None:
    draw = random.Random("symmetry")
    for x in (draw.uniform(0.0, 1e5) for _ in range(5000)):
        assert bits(PYTHON["sin"](-x)) == bits(-PYTHON["sin"](x))
        assert bits(PYTHON["cos"](-x)) == bits(PYTHON["cos"](x))


@pytest.mark.parametrize("name", ONE)
def test_nan_stays_nan(name: str) -> None:
    assert math.isnan(PYTHON[name](math.nan))
    assert math.isnan(PYTHON[name](-math.nan))


def test_exact_values() -> None:
    for zero in (0.0, -0.0):
        assert bits(PYTHON["sin"](zero)) == bits(zero)
        assert bits(PYTHON["tan"](zero)) == bits(zero)
        assert bits(PYTHON["tanh"](zero)) == bits(zero)
        assert bits(PYTHON["cos"](zero)) == bits(1.0)
        assert bits(PYTHON["exp"](zero)) == bits(1.0)
    for x in (5e-324, 2.0**-1022, 1e-300, 2.0**-55):
        assert PYTHON["sin"](x) == PYTHON["tan"](x) == PYTHON["tanh"](x) == x
        assert PYTHON["exp"](-x) == PYTHON["cos"](x) == 1.0
    for x in (19.07, 20.0, 1e3, 1.7e308, math.inf):
        assert PYTHON["tanh"](x) == 1.0
        assert PYTHON["tanh"](-x) == -1.0
    assert PYTHON["tanh"](19.06) < 1.0
    assert bits(PYTHON["log"](1.0)) == bits(0.0)
    for x in (0.0, -1.0, -math.inf, 5e-324):
        assert PYTHON["log"](x) == PYTHON["log"](sys.float_info.min)
    assert PYTHON["log"](math.inf) == PYTHON["log"](sys.float_info.max)


def test_log_grows_with_its_argument() -> None:
    draw = random.Random("log grows")
    for x in (anywhere("log", draw) for _ in range(2000)):
        values = [PYTHON["log"](y) for y in sorted(y for y in neighbours_of(x, 2) if y > 0.0)]
        assert values == sorted(values)


def test_monotone_near_the_clamps() -> None:
    def values(name: str, x: float) -> list[float]:
        return [PYTHON[name](y) for y in neighbours_of(x, 400)]

    for x in BOUNDS["exp"]:
        assert values("exp", x) == sorted(values("exp", x))
    for x in (19.06154, 20.0):
        assert values("tanh", x) == sorted(values("tanh", x))
        assert values("tanh", -x) == sorted(values("tanh", -x))
    # sin and cos of 1e5 + t: both slopes there, -0.9994 and -0.0357, are far from 0. The two
    # reductions of angles meet there.
    for name in ("sin", "cos"):
        assert values(name, 1e5) == sorted(values(name, 1e5), reverse=True)


def test_within_minus_one_and_one() -> None:
    for n in range(-63_661, 63_662, 7):
        for x in neighbours_of(n * (math.pi / 2), 1):
            assert abs(PYTHON["sin"](x)) <= 1.0
            assert abs(PYTHON["cos"](x)) <= 1.0
