"""atan2 against mpmath in every octant and bracket, at zeros, infinities and subnormals; floor."""

from __future__ import annotations

import math
import random

import mpmath
import pytest
from hypothesis import given, strategies as st

from language.numerics.evaluate import floor
from language.numerics.function_table import FUNCTIONS
from tests.language.ulp_errors import PYTHON, bits, stated_error, ulp_error

POINTS = 40_000
ANGLE = PYTHON["atan2"]
PI = math.pi


def anywhere(draw: random.Random) -> tuple[float, float]:
    """Return rise and run: of any size, near the limits of the brackets, near one octant."""
    signs = draw.choice((1.0, -1.0)), draw.choice((1.0, -1.0))
    choice = draw.randrange(4)
    if choice == 0:
        pair = draw.random(), draw.random()
    elif choice == 1:
        pair = 2.0 ** draw.uniform(-1074.0, 1023.99), 2.0 ** draw.uniform(-1074.0, 1023.99)
    elif choice == 2:
        run = draw.uniform(0.5, 1.0)
        bracket = draw.choice((0.4375, 0.6875, 1.0, 0.5)) * (1.0 + draw.uniform(-1e-3, 1e-3))
        pair = draw.choice(((run * bracket, run), (run, run * bracket)))
    else:
        pair = draw.uniform(0.2, 0.45), draw.uniform(0.7, 1.0)
    return signs[0] * pair[0], signs[1] * pair[1]


def test_error_is_as_stated() -> None:
    draw = random.Random("atan2")
    with mpmath.workdps(60):
        pairs = [anywhere(draw) for _ in range(POINTS)]
        worst = max(pairs, key=lambda pair: ulp_error("atan2", *pair))
        assert ulp_error("atan2", *worst) < stated_error(FUNCTIONS["atan2"]), worst


@pytest.mark.parametrize(
    ("rise", "run", "angle"),
    [
        (0.0, 0.0, 0.0),
        (-0.0, 0.0, -0.0),
        (0.0, -0.0, 0.0),
        (0.0, 1.0, 0.0),
        (-0.0, 1.0, -0.0),
        (0.0, -1.0, PI),
        (-0.0, -1.0, PI),
        (-5e-324, -1.0, -PI),
        (1.0, 0.0, PI / 2),
        (-1.0, -0.0, -PI / 2),
        (5e-324, 5e-324, PI / 4),
        (5e-324, 1.0, 5e-324),
        (-3e-310, 1.0, -3e-310),
        (1.7e308, 1.7e308, PI / 4),
        (-1.7e308, 1.7e308, -PI / 4),
        (1.0, math.inf, 0.0),
        (-1.0, -math.inf, -PI),
        (math.inf, 1.0, PI / 2),
        (math.inf, -math.inf, 3 * PI / 4),
    ],
)
def test_exact_values(rise: float, run: float, angle: float) -> None:
    assert bits(ANGLE(rise, run)) == bits(angle)


@pytest.mark.parametrize("other", [0.0, -0.0, 1.0, -1.0, math.inf, math.nan])
def test_nan_stays_nan(other: float) -> None:
    assert math.isnan(ANGLE(math.nan, other))
    assert math.isnan(ANGLE(other, math.nan))


@given(st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_the_value_is_an_angle_on_the_side_of_its_point(rise: float, run: float) -> None:
    angle = ANGLE(rise, run)
    assert -PI <= angle <= PI
    assert (angle > PI / 2 or angle < -PI / 2) <= (run < 0.0)
    assert rise == 0.0 or (angle >= 0.0) == (rise > 0.0)
    assert rise == 0.0 or bits(ANGLE(-rise, run)) == bits(-angle)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floor_is_the_largest_whole_number_not_above(x: float) -> None:
    assert floor(x) == math.floor(x)
    assert math.copysign(1.0, floor(-0.0)) == -1.0


@pytest.mark.parametrize("x", [math.inf, -math.inf, math.nan, -0.0])
def test_floor_of_what_has_none_is_itself(x: float) -> None:
    assert bits(floor(x)) == bits(x)
