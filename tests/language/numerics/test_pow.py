"""pow against mpmath in both types: bases of any size and near 1, degrees of any size; clamps."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import mpmath
import pytest

from language.ir.number_type import NumberType, round_to_float32
from language.numerics.evaluate import apply_function
from language.numerics.function_table import FUNCTIONS
from tests.language.numerics import test_float32_constants as of_single
from tests.language.ulp_errors import PYTHON, stated_error, ulp_error

Kept = Callable[[float], float]
POINTS = 20_000
POWER = PYTHON["pow"]


def anywhere(draw: random.Random, lowest: int, bound: float, kept: Kept) -> tuple[float, float]:
    """Return a base and a degree whose power lies within the domain of exp, up to `bound`."""
    kind = draw.randrange(4)
    if kind == 0:
        base = draw.uniform(1e-3, 10.0)
    elif kind == 1:
        base = 2.0 ** draw.uniform(lowest, -lowest)
    elif kind == 2:
        base = 1.0 + draw.choice((-1.0, 1.0)) * 2.0 ** draw.uniform(-22.0, -1.0)
    else:
        base = math.sqrt(0.5) * draw.uniform(0.999, 1.001) * 2.0 ** draw.randrange(-5, 5)
    base = kept(base)
    power = draw.uniform(-bound, bound) * draw.choice((1.0, draw.random()))
    return base, kept(power / (math.log(base) or 1.0))


def test_error_is_as_stated() -> None:
    draw = random.Random("pow")
    with mpmath.workdps(60):
        pairs = [anywhere(draw, -1000, 707.0, float) for _ in range(POINTS)]
        worst = max(pairs, key=lambda pair: ulp_error("pow", *pair))
        assert ulp_error("pow", *worst) < stated_error(FUNCTIONS["pow"]), worst


def test_error_is_as_stated_in_float32() -> None:
    draw = random.Random("single pow")
    pairs = [anywhere(draw, -125, 86.0, round_to_float32) for _ in range(of_single.POINTS)]
    worst = max(pairs, key=lambda pair: of_single.ulp_error("pow", *pair))
    assert of_single.ulp_error("pow", *worst) < of_single.stated_error("pow"), worst


@pytest.mark.parametrize(
    ("base", "degree", "power"),
    [
        *((0.0, 2.0, 0.0), (0.0, 0.0, 1.0), (5.0, 0.0, 1.0), (1.0, 1e300, 1.0)),
        *((2.0, 3.0, 8.0), (9.0, 0.5, 3.0), (2.0, -1.0, 0.5), (1.0, -math.inf, 1.0)),
        *((-3.0, 2.0, 0.0), (-0.0, 0.5, 0.0)),
    ],
)
@pytest.mark.parametrize("number", ["float64", "float32"])
def test_values_that_are_known(
    base: float, degree: float, power: float, number: NumberType
) -> None:
    arguments = [round_to_float32(base), round_to_float32(degree)]
    assert apply_function("pow", arguments, number) == power


def test_a_power_is_clamped_as_exp_is() -> None:
    exp = PYTHON["exp"]
    for base, degree in ((10.0, 400.0), (2.0, math.inf), (0.1, -400.0), (math.inf, 1.0)):
        assert POWER(base, degree) == exp(math.inf)
    for base, degree in ((10.0, -400.0), (2.0, -math.inf), (1e-300, 3.0)):
        assert POWER(base, degree) == exp(-math.inf)
    assert POWER(0.0, -1.0) == pytest.approx(2.0**1022)


def test_nan_stays_nan() -> None:
    for pair in ((math.nan, 2.0), (2.0, math.nan), (math.nan, 0.0), (math.nan, math.nan)):
        assert math.isnan(POWER(*pair))


def test_a_power_grows_with_its_base() -> None:
    draw = random.Random("pow grows")
    for _ in range(2000):
        base, degree = draw.uniform(0.1, 10.0), draw.uniform(0.1, 20.0)
        assert POWER(base, degree) <= POWER(base * (1.0 + 1e-15), degree)
