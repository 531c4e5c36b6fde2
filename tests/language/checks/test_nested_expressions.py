"""The effort of a check grows linearly with the depth of nested expressions.

Each case would take minutes if one pass visited an operand twice in each operation around it.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw
from language.ir.traversal import subexpressions
from language.lowering.expressions import lower_expression
from language.smt.lie_derivative import LieDerivative
from language.smt.symbolic_environment import GuardSnapshot
from tests.language.spec_builders import automaton, tree

SAMPLED = """language: 1
automaton: nested
period: 10 ms
numbers: float32
parameters: {{p: {{value: 0.5}}}}
inputs: {{u: {{unit: 1, range: [-2, 2]}}}}
equations: {{z: "{value}"}}
initial: a
modes:
  a: {{transitions: {{b: {{when: "{value} > p"}}}}}}
  b: {{transitions: {{a: {{when: "z < p"}}}}}}
outputs: [z, mode]
"""
CONTINUOUS = """language: 1
automaton: nested
parameters: {{p: {{value: 0.5}}}}
inputs: {{w: {{unit: 1, range: [-2, 2]}}}}
states: {{u: {{unit: 1, initial: 0}}}}
equations: {{z: "{value}"}}
flow: {{u: 1 s * der(u) = w - u}}
initial: a
modes:
  a: {{transitions: {{b: {{when: "{value} > p"}}}}}}
  b: {{transitions: {{a: {{when: "u < p"}}}}}}
outputs: [z, mode]
"""
OPERATIONS = {
    "max": "max(u, {})",
    "max, first argument": "max({}, u)",
    "min": "min(u + 0.25, {})",
    "abs": "abs(u - {})",
    "clip": "clip({}, -1.5, 1.5)",
    "clip, last argument": "clip(u, -1.5, {})",
    "if": "(if u > 0.5 then u else {})",
    "if, condition": "(if {} > 0.5 then u else p)",
    "sum": "(u + {})",
    "product": "(0.5 * u * {})",
    "quotient": "(u / (2 + abs({})))",
    "square root": "sqrt(1 + abs({}))",
    "sign": "(u * sign({}))",
    "sine": "sin(u * 1 rad + {} * 1 rad)",
}


def nest(operation: str, depth: int) -> str:
    """Return `u` inside `depth` operations."""
    text = "u"
    for _ in range(depth):
        text = operation.format(text)
    return text


@pytest.mark.parametrize("spec", [SAMPLED, CONTINUOUS], ids=["sampled", "continuous"])
@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
@pytest.mark.parametrize("depth", [24, 60])
def test_a_check_ends(operation: str, spec: str, depth: int, tmp_path: Path) -> None:
    path = tmp_path / "nested.yaml"
    path.write_text(spec.format(value=nest(operation, depth)))
    found = [problem for problem in mw.check(str(path)) if problem.severity == "error"]
    assert {problem.kind for problem in found} <= {"expression", "refire"}


@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
def test_lowering_and_derivatives_are_linear_in_the_depth(operation: str) -> None:
    made = automaton(CONTINUOUS.format(value="u"))
    sizes = []
    for depth in (4, 8, 12):
        snapshot = GuardSnapshot(made, made.modes["a"])
        expr = snapshot.lower_expression(tree(nest(operation, depth)))
        LieDerivative(snapshot).differentiate(expr)
        parts = [subexpressions(value) for _, value in snapshot.path.assignments]
        sizes.append(len(subexpressions(expr)) + sum(map(len, parts)))
    assert sizes[2] - sizes[1] == sizes[1] - sizes[0]


def test_an_operand_is_lowered_once() -> None:
    reads: list[str] = []

    class Bindings(dict[str, object]):
        """Bindings that record each look-up of a name."""

        def __getitem__(self, name: str) -> object:
            reads.append(name)
            return super().__getitem__(name)

    made = automaton(SAMPLED.format(value="u"))
    snapshot = GuardSnapshot(made, made.modes["a"])
    lower_expression(tree(nest("max(u, abs({}))", 20)), Bindings(snapshot.bindings))  # type: ignore[arg-type]
    assert len(reads) <= 3 * 21


def test_nested_powers_are_limited(tmp_path: Path) -> None:
    path = tmp_path / "nested.yaml"
    path.write_text(SAMPLED.format(value=nest("({})^2", 24)))
    (problem,) = {problem.label: problem for problem in mw.check(str(path))}.values()
    assert problem.kind == "power"
    assert problem.label == "the powers in this expression have more than 10000 factors"
    path.write_text(SAMPLED.format(value=nest("({})^3", 4)))
    assert all(problem.severity == "warning" for problem in mw.check(str(path)))
