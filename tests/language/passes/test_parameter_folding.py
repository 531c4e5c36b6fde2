"""Optimising passes: what does not change is computed once, with the same value."""

from __future__ import annotations

import pytest

from engine.interpreter.interpreter import Interpreter
from language.ir.ops import Assign
from language.ir.printer import format_expr
from language.ir.program import Program
from language.ir.traversal import walk_ops
from language.loading.load import lower_automaton
from language.passes.input_hoisting import hoist_inputs
from language.passes.parameter_folding import fold_parameters
from language.passes.pass_list import run_passes
from tests.language.spec_builders import automaton

TEXT = """language: 1
automaton: slide
step: 1 ms
parameters:
  m: {value: 3 kg}
  g: {value: 9.81 m/s^2}
  c: {value: 0.7 kg/s, tunable: true, range: [0, 2]}
  nil: {value: 1.0e+308 kg}
  s: {value: 1 m}
inputs: {F: {unit: N, range: [-9, 9]}, slope: {unit: rad, range: [-1, 1]}}
states: {v: {unit: m/s, initial: 2 m/s, range: [-9, 9]}}
equations:
  pull: F - m * g * sin(slope) - c / m * v * m
  never: v / nil * m
  third: v / 3
  drag: (v * v + v * v * v / (1 m/s)) * m / s
flow: {v: "m * der(v) = pull - drag"}
initial: go
modes: {go: {equations: {}}}
outputs: [v, never, third, pull]
"""


def slide() -> Program:
    return lower_automaton(automaton(TEXT))


def assigned(program: Program, block: str) -> dict[str, str]:
    """Return the assignments of a block as text."""
    ops = walk_ops(program.blocks[block])
    return {op.target: format_expr(op.value) for op in ops if isinstance(op, Assign)}


def test_what_follows_from_fixed_parameters_is_a_constant() -> None:
    found = {c.name: (c.kind, c.value, c.about) for c in fold_parameters(slide()).constants}
    assert found["constant.m_g"] == ("fixed", 3.0 * 9.81, "m * g")
    assert found["constant.per_m"] == ("fixed", 1.0 / 3.0, "1 / m")


def test_what_follows_from_a_tunable_is_derived_again_after_a_change() -> None:
    made = run_passes(slide())
    assert assigned(made, "derive") == {"derived.c_per_m": "(calibration.c / constant.m)"}
    stepper = Interpreter(made)
    stepper.set("calibration.c", 1.5)
    stepper.run("derive")
    assert stepper.get("derived.c_per_m") == 1.5 / 3.0


def test_a_division_by_a_parameter_is_a_multiplication_unless_its_inverse_is_not_normal() -> None:
    made = fold_parameters(slide())
    assert assigned(made, "rates_go")["work.rate_v"].endswith("* constant.per_m)")
    assert assigned(made, "equations_go")["equation.never"] == (
        "((state.v / constant.nil) * constant.m)"
    )
    assert assigned(made, "equations_go")["equation.third"] == "(state.v / 3.0)"


def test_what_reads_frozen_inputs_and_fixed_parameters_is_computed_where_they_are_latched() -> None:
    made = hoist_inputs(fold_parameters(slide()))
    latched = assigned(made, "latch")
    assert latched["before.F_minus_m_g_sin_slope"] == (
        "(before.F - (constant.m_g * sin(before.slope)))"
    )
    assert "sin(" not in "".join(assigned(made, "rates_go").values())


def test_a_value_that_a_block_computes_twice_is_computed_once() -> None:
    rates = assigned(run_passes(slide()), "rates_go")
    assert rates["work.v_squared"] == "(work.at_v * work.at_v)"
    texts = [text for name, text in rates.items() if name != "work.v_squared"]
    assert not any("(work.at_v * work.at_v)" in text for text in texts)


@pytest.mark.parametrize("slope", [0.0, -0.3, 1.0])
def test_the_values_stay_but_for_the_rounding_of_a_reciprocal(slope: float) -> None:
    values = []
    for made in (slide(), run_passes(slide())):
        stepper = Interpreter(made)
        for name, value in (("F", 4.0), ("slope", slope)):
            stepper.set(f"input.{name}", value)
        for block in ("latch", "start", "equations"):
            stepper.run(block)
        stepper.set("work.h", 1e-3)
        stepper.run("flow")
        stepper.run("equations")
        names = ("state.v", "equation.pull", "equation.third", "equation.never")
        values.append([stepper.get(name) for name in names])
    before, after = values
    assert 0.0 < before[3] < 1e-300
    assert after == pytest.approx(before, rel=1e-14)
    assert after[2:] == before[2:]
