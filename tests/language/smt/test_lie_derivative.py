"""Along: how expressions change along a flow, against difference quotients of the expressions."""

from __future__ import annotations

import pytest

from language.ir.ops import Expr
from language.numerics.evaluate import evaluate
from language.smt.lie_derivative import LieDerivative
from language.smt.symbolic_environment import GuardSnapshot
from tests.language.spec_builders import automaton, tree

SPEC = """language: 1
automaton: flowing
step: 1 ms
states: {x: {unit: "1", initial: 0.4}, z: {unit: "1", initial: 1.3}}
flow: {x: der(x) = 0.7 1/s, z: der(z) = x * 1 1/s}
outputs: [x, z]
"""
TEXTS = [
    *("x * z - x / z", "x^3", "abs(x - z)", "min(x, z)", "max(x, z)", "clip(x, 0.1, z)"),
    *("sqrt(x) * z", "log(z)", "exp(x)", "tanh(x * z)", "sin(z * 1 rad)", "cos(x * 1 rad)"),
    *("pow(z, 2.5)", "pow(x, z)", "pow(x + z, -x)", "if x < z then x * z else 0", "sign(x)"),
]
STEP = 1e-6


def at(expr: Expr, moment: GuardSnapshot, x: float, z: float) -> float:
    """Return an expression with what its story computes before it."""
    values: dict[str, float | int | bool] = {"state.x": x, "state.z": z}
    for target, value in moment.path.assignments:
        values[target] = evaluate(value, values)
    return float(evaluate(expr, values))


@pytest.mark.parametrize("text", TEXTS)
def test_a_rate_is_that_of_the_values(text: str) -> None:
    made = automaton(SPEC)
    moment = GuardSnapshot(made, next(iter(made.modes.values())))
    expr = moment.lower_expression(tree(text))
    rate = LieDerivative(moment).differentiate(expr)
    x, z = 0.4, 1.3
    later, before = (at(expr, moment, x + 0.7 * t, z + x * t + 0.35 * t * t) for t in (STEP, -STEP))
    expected = (later - before) / (2.0 * STEP)
    assert at(rate, moment, x, z) == pytest.approx(expected, rel=1e-6, abs=1e-8)
