"""Derivative: every rule against mpmath's numerical differentiation; corners are refused."""

from __future__ import annotations

import mpmath
import pytest

from language.expressions.differentiate import differentiate
from language.expressions.simplify import is_one, is_zero, substitute_names
from language.expressions.syntax_tree import Name, SyntaxTree, names
from language.ir.ops import Ref
from language.lowering.expressions import lower_expression
from language.numerics.evaluate import evaluate
from tests.language.spec_builders import raised_problems, tree

NAMES = {name: Ref(name) for name in ("x", "z")}
Z = 0.7


def value(expr: SyntaxTree, x: float) -> float:
    return float(evaluate(lower_expression(expr, NAMES), {"x": x, "z": Z}))


def slope(text: str, x: float) -> float:
    return value(differentiate(tree(text), "x", lambda part: value(part, x)), x)


SMOOTH = [
    "3 * x - z * x / 2 + 5",
    "x^3 - 2 * x^2 + x^-1",
    "x^-4",
    "(x + z)^5",
    "-(x * x) * -x",
    "(x - z) / (x^2 + 1)",
    "z / x",
    "x / z / x^2",
    "sin(x * z) - cos(x^2)",
    "exp(-x) * tanh(2 * x)",
    "sqrt(x + 1) / sqrt(x)",
    "if z > 0 then x^2 else x",
    "tan(x / 2) * atan2(x, z - x)",
    "pow(x^2 + 1, 1.7) * pow(z^2 + 1, sin(x * 1 rad))",
    "log(x^2 + z^2 + 1) * x",
]
BRANCHED = [
    "abs(x - z) * x",
    "min(x^2, x) + max(x^2, z)",
    "clip(x * x, 0.2, 0.8)",
    "sign(x - z) * x^2",
    "if x > z then x^3 else 2 * x",
    "if x < z and not (x >= 2) or x > 1.5 then x^3 else 2 * x",
    "if if x < z then true else x > 1.5 then x^3 else 2 * x",
    "max(abs(sin(x)), min(x, z))",
    "floor(3 * x) * x",
]


@pytest.mark.parametrize("x", [0.25, 0.6, 0.95, 1.7])
@pytest.mark.parametrize("text", [*SMOOTH, *BRANCHED])
def test_the_derivative_is_the_slope(text: str, x: float) -> None:
    with mpmath.workdps(15):
        expected = mpmath.diff(lambda u: mpmath.mpf(value(tree(text), float(u))), x, h=1e-5)
    assert slope(text, x) == pytest.approx(float(expected), rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("x^2", 3.0), ("x^-1", -1 / 2.25), ("1 / x", -1 / 2.25), ("5 * x / 4", 1.25), ("x - z", 1.0)],
)
def test_simple_derivatives_are_exact(text: str, expected: float) -> None:
    assert slope(text, 1.5) == expected


@pytest.mark.parametrize("text", ["z", "z * z", "5", "sin(z)", "if z > 0 then 1 else 2"])
def test_what_does_not_read_the_name_has_the_derivative_zero(text: str) -> None:
    assert is_zero(differentiate(tree(text), "x", lambda part: 0.0))


@pytest.mark.parametrize(
    "text",
    [
        "abs(x)",
        "min(x, 0)",
        "max(-x, x)",
        "sign(x)",
        "clip(x, 0, 1)",
        "floor(x)",
        "if x > 0 then x else -x",
    ],
)
def test_a_corner_at_the_point_is_refused(text: str) -> None:
    (problem,) = raised_problems(lambda: slope(text, 0.0))
    assert "no derivative there" in problem.label
    assert not raised_problems(lambda: slope(text, 0.5))


def test_a_function_without_a_derivative_is_refused() -> None:
    (problem,) = raised_problems(lambda: slope("delay(x, 1)", 0.5))
    assert problem.label == "`delay` has no derivative here"


def test_what_is_exactly_zero_or_one_is_left_out() -> None:
    assert is_one(differentiate(tree("z + x - 3"), "x", lambda part: 0.0))
    twice = differentiate(tree("z * x"), "x", lambda part: 0.0)
    assert isinstance(twice, Name) and twice.path == "z"
    assert is_zero(substitute_names(tree("z * (x - x) + 0 / z"), {}))
    assert [name.path for name in names(substitute_names(tree("x * z"), {"x": tree("1")}))] == ["z"]
