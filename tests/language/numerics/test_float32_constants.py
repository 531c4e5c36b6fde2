"""The elementary functions in float32: stated errors against mpmath, symmetry, clamps, numbers."""

from __future__ import annotations

import math
import random
import re
import struct

import mpmath
import pytest

from language.ir.number_type import MAX_FINITE, round_to_float32
from language.ir.ops import Assign, Value
from language.ir.traversal import walk_ops
from language.numerics.evaluate import apply_function
from language.numerics.function_table import FUNCTIONS, FUNCTIONS_BY_TYPE
from tests.language.ulp_errors import EXACT

POINTS = 3000
SINGLES = FUNCTIONS_BY_TYPE["float32"]
BOUNDS = {
    **dict.fromkeys(("sin", "cos", "tan"), (-MAX_FINITE["float32"], MAX_FINITE["float32"])),
    "exp": (-87.0, 88.0),
    "tanh": (-12.0, 12.0),
    "log": (2.0**-126, (2.0 - 2.0**-23) * 2.0**127),
}
WORST = {
    "exp": float.fromhex("0x1.b68b6ep+4"),
    "tanh": float.fromhex("0x1.411556p-1"),
    "sin": float.fromhex("0x1.ce8e52p+8"),
    "cos": float.fromhex("0x1.c26f2p+9"),
    "log": float.fromhex("0x1.69cf3ep+0"),
}
"""Where the error is largest among all float32 of the domain: all were tried once."""


def ulp_error(name: str, *x: float) -> float:
    """Return the error at x in ULP of float32 of the exact result."""
    with mpmath.workdps(40):
        exact = EXACT[name](*(mpmath.mpf(value) for value in x))
        result = float(apply_function(name, list(x), "float32"))
        if exact == 0:
            return 0.0 if result == 0.0 else math.inf
        unit = max(int(mpmath.frexp(abs(exact))[1]) - 24, -149)
        return float(abs(mpmath.ldexp(mpmath.mpf(result) - exact, -unit)))


def stated_error(name: str) -> float:
    found = re.fullmatch(r".*; error < ([0-9.]+) ULP", SINGLES[name].about)
    assert found
    return float(found[1])


def anywhere(name: str, draw: random.Random) -> float:
    low, high = BOUNDS[name]
    choice = draw.randrange(3)
    if name in ("sin", "cos", "tan"):
        if draw.random() < 0.1:
            return round_to_float32(draw.choice((-1.0, 1.0)) * 2.0 ** draw.uniform(9.0, 127.9))
        low, high = -1000.0, 1000.0
    if name == "log" and choice < 2:
        power = draw.uniform(-126.0, 127.9) if choice else draw.uniform(-0.6, 0.6)
        return round_to_float32(math.exp2(power))
    if choice == 0:
        return round_to_float32(draw.uniform(low, high))
    if choice == 1:
        size = 2.0 ** draw.uniform(-30.0, math.log2(high))
        return max(low, round_to_float32(draw.choice((-1.0, 1.0)) * size))
    quarter = draw.randrange(-636, 637) * (math.pi / 2) if name in ("sin", "cos", "tan") else 0.6
    return max(low, min(high, round_to_float32(quarter * (1.0 + draw.uniform(-1e-6, 1e-6)))))


@pytest.mark.parametrize("name", BOUNDS)
def test_error_is_as_stated(name: str) -> None:
    draw = random.Random(f"single {name}")
    points = [anywhere(name, draw) for _ in range(POINTS)] + [*BOUNDS[name]]
    points += [WORST[name]] if name in WORST else []
    worst = max(points, key=lambda x: ulp_error(name, x))
    assert ulp_error(name, worst) < stated_error(name), worst


def test_the_angle_of_a_point_is_as_stated() -> None:
    draw = random.Random("single atan2")
    pairs = []
    for _ in range(POINTS):
        run = 2.0 ** draw.uniform(-140.0, 120.0)
        rise = run * 2.0 ** draw.uniform(-3.0, 3.0)
        pairs.append(
            (
                draw.choice((1, -1)) * round_to_float32(rise),
                draw.choice((1, -1)) * round_to_float32(run),
            )
        )
    worst = max(pairs, key=lambda pair: ulp_error("atan2", *pair))
    assert ulp_error("atan2", *worst) < stated_error("atan2"), worst


@pytest.mark.parametrize(
    ("rise", "run", "angle"),
    [
        (-0.0, 1.0, -0.0),
        (0.0, -1.0, math.pi),
        (1.0, 0.0, math.pi / 2),
        (2.0**-149, 2.0**-149, math.pi / 4),
        (3.4e38, 3.4e38, math.pi / 4),
        (math.inf, -math.inf, 3 * math.pi / 4),
    ],
)
def test_exact_angles(rise: float, run: float, angle: float) -> None:
    found = apply_function("atan2", [round_to_float32(rise), round_to_float32(run)], "float32")
    assert struct.pack("<f", found) == struct.pack("<f", angle)


def test_symmetry_clamps_and_nan() -> None:
    for name in ("sin", "tan", "tanh"):
        for x in (0.0, 2.0**-149, 2.0**-13, 0.5, 3.0, 999.0):
            plus, minus = (
                float(apply_function(name, [sign * x], "float32")) for sign in (1.0, -1.0)
            )
            assert struct.pack("<f", -plus) == struct.pack("<f", minus)
    for name, (low, high) in BOUNDS.items():
        if name != "tanh":
            assert apply_function(name, [math.inf], "float32") == apply_function(
                name, [high], "float32"
            )
            assert apply_function(name, [-math.inf], "float32") == apply_function(
                name, [low], "float32"
            )
        assert math.isnan(apply_function(name, [math.nan], "float32"))


def test_both_types_have_the_same_functions_and_every_number_is_a_float32() -> None:
    assert list(SINGLES) == list(FUNCTIONS)
    for function in SINGLES.values():
        for op in walk_ops(function.body):
            assert isinstance(op, Assign)
            for text in re.findall(r"Value\(value=([^)]+)\)", repr(op.value)):
                value = Value(float(text)).value
                assert round_to_float32(float(value)) == value, function.name
