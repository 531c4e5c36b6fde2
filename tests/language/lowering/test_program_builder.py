"""Wiring: outputs, defaults and start values, and that a Program keeps only what it uses."""

from __future__ import annotations

import dataclasses
import re

import pytest

from language.ir.ops import (
    Assign,
    Binary,
    Branch,
    Call,
    Compare,
    Item,
    Loop,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
    Unary,
    Value,
    real,
)
from language.ir.program import Program
from language.ir.traversal import called_functions, expr_functions, expr_names, names_used, walk_ops
from language.loading.load import program_of
from language.lowering.program_builder import finalise_program
from language.numerics.function_table import FUNCTIONS
from tests.language.spec_builders import load_shipped, program, stepper

TEXT = """language: 1
automaton: machine
period: 1 ms
numbers: float64
parameters:
  used: {value: 2 m}
  idle: {value: 3 m}
  tuned: {value: 4 m, tunable: true}
  follows: {derived: 2 * tuned, unit: m}
inputs:
  u: {unit: mm, default: 5}
  flag: {type: bool, default: true}
  must: {unit: V}
states: {x: {unit: m, initial: z + used}, z: {unit: m, initial: u}}
equations: {twice: 2 * x, high: x > used, bend: "sin(x / used * 1 rad)"}
modes:
  only: {update: {x: follows}}
outputs: [high, x, mode, twice]
"""


def names_of(made: Program, group: str) -> list[str]:
    full = [v.name for v in made.variables] + [c.name for c in made.constants]
    return [name.partition(".")[2] for name in full if name.startswith(f"{group}.")]


def test_outputs_are_wired_in_the_order_of_the_file() -> None:
    wires = [(wire.name, wire.source, wire.type, wire.unit) for wire in program(TEXT).outputs]
    assert wires == [
        ("high", "equation.high", "truth", "1"),
        ("x", "state.x", "real", "m"),
        ("mode", "memory.mode", "whole", "1"),
        ("twice", "equation.twice", "real", "m"),
    ]


def test_defaults_are_in_si_and_only_where_given() -> None:
    assert program(TEXT).defaults == {"u": 0.005, "flag": True}


def test_inputs_are_kept_though_nothing_reads_them() -> None:
    made = program(TEXT)
    assert names_of(made, "input") == ["u", "flag", "must"]
    assert [v.type for v in made.inputs] == ["real", "truth", "real"]


def test_a_start_value_reads_inputs_parameters_and_other_start_values() -> None:
    inside = stepper(TEXT)
    inside.set("input.u", 0.25)
    inside.run("start")
    assert (inside.get("state.z"), inside.get("state.x")) == (0.25, 2.25)


def test_a_constant_that_nothing_reads_is_left_out() -> None:
    made = program(TEXT)
    assert names_of(made, "constant") == ["used", "per_used"]
    assert names_of(made, "calibration") == ["tuned"]
    assert names_of(made, "derived") == ["follows"]


def test_a_tunable_that_only_a_solved_number_came_from_is_kept() -> None:
    text = """language: 1
automaton: seen
period: 1 ms
numbers: float64
parameters: {q: {value: 1 m^2/s, tunable: true}, r: {value: 1 m^2}}
inputs: {x_m: {unit: m}}
states: {x: {unit: m, initial: 0 m}}
modes:
  only:
    observer:
      kalman: {states: [x]}
      A: {x: {x: 0 1/s}}
      measures: {x_m: x}
      process_noise: {x: q}
      measurement_noise: {x_m: r}
outputs: [x]
"""
    made = program(text)
    assert names_of(made, "calibration") == ["q"]
    assert names_of(made, "constant") == []
    assert "is_new.x_m" in [v.name for v in made.variables]


def test_the_memory_of_an_input_that_nobody_looks_back_at_is_left_out() -> None:
    made = program(TEXT)
    assert names_of(made, "before") == []
    assert made.blocks["retain_inputs"] == ()


def test_a_function_comes_with_those_that_it_calls() -> None:
    plain = re.sub(r", bend: .*}", "}", TEXT)
    assert program(plain).functions == ()
    made = program(TEXT)
    called = called_functions(made.blocks.values())
    assert "sin" in called
    wanted = (called | called_functions(f.body for f in made.functions)) & set(FUNCTIONS)
    assert {function.name for function in made.functions} == wanted


@pytest.mark.parametrize("name", ["estimator", "driveline", "estimator_simple"])
def test_a_shipped_program_has_every_name_that_it_uses_and_uses_every_name(name: str) -> None:
    made = program_of(load_shipped(name))
    used = names_used(made.blocks.values())
    used |= {wire.source for wire in made.outputs}
    known = {v.name for v in made.variables} | {c.name for c in made.constants}
    assert used <= known | {"memory.faults"}
    kept = {name for name in known if name.startswith(("input.", "is_new."))}
    stamped = {f"calibration.{n}" for c in made.constants for n in c.depends_on}
    assert known - used - kept - stamped <= {"memory.faults"}


def test_blocks_that_no_entry_reaches_are_left_out() -> None:
    made = program(TEXT)
    blocks = {**made.blocks, "lost": (RunBlock("lost_too"),), "lost_too": ()}
    again = finalise_program(dataclasses.replace(made, blocks=blocks), ("init", "derive", "step"))
    assert again.blocks == made.blocks


def test_finishing_twice_changes_nothing() -> None:
    made = program(TEXT)
    assert finalise_program(made, ("init", "derive", "step")) == made


X, Y, K = Ref("state.x"), Ref("state.y"), Ref("work.k")


def test_every_name_in_an_expression_is_found() -> None:
    expr = Select(
        Compare("<", X, Item("work.list", K)),
        Call("sin", (Unary("-", Y),)),
        Binary("+", real(1.0), Ref("constant.c")),
    )
    assert list(expr_names(expr)) == [
        "state.x",
        "work.list",
        "work.k",
        "state.y",
        "constant.c",
    ]
    assert expr_functions(expr) == ["sin"]
    assert list(expr_names(Value(True))) == []


def test_every_operation_is_walked_parents_first() -> None:
    inner = Assign("work.a", X)
    stored = Store("work.list", K, Y)
    loop = Loop(3, "work.k", (stored,))
    branch = Branch(Compare(">", X, Y), (inner,), (loop,))
    choose = Switch("memory.mode", ((1, (branch,)), (2, (RunBlock("b"),))))
    assert list(walk_ops((choose,))) == [choose, branch, inner, loop, stored, RunBlock("b")]
    assert names_used([(choose,)]) >= {
        "memory.mode",
        "state.x",
        "state.y",
        "work.a",
        "work.list",
        "work.k",
    }
