"""Derived: an observer's matrices out of the balances of the model, against closed forms."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from language.loading.load import lower_automaton, program_of
from tests.language.spec_builders import (
    load_shipped,
    problem_lines,
    program,
    project_of,
    solve_constants,
)

MODEL = """language: 1
automaton: m
parameters: {k: {value: 3 1/s}, c: {value: 0.5 1/s}, p: {value: 2}}
inputs:
  u: {unit: 1/s}
  tilt: {unit: 1/s, default: 0 1/s}
  more: {unit: 1/s, default: 0.25 1/s}
states: {x: {unit: "1", initial: 1}, v: {unit: "1", initial: 0}, z: {unit: "1", initial: 0}}
equations: {pull: k * (x - z) + c * v, bent: k * v^2 / p}
flow: {x: der(x) = c * v, v: p * der(v) = u - pull - bent + 3 1/s * sin(1 s * tilt) + more}
initial: still
modes:
  still: {flow: {z: der(z) = 0}}
  moves: {flow: {z: der(z) = k * z}}
"""
OBSERVER = """language: 1
automaton: o
period: 0.1 s
numbers: float64
model: m
inputs: {y_x: {unit: "1"}, y_p: {unit: 1/s}, u: {unit: 1/s}, tilt: {unit: 1/s, default: 0 1/s}}
states:
  x: {initial: 0}
  v: {initial: 0}
  z: {initial: 0.5}
modes:
  only:
    observer:
      kalman: {states: [x, v]}
      of: m.still
      at: {v: 1.5}
      measures: {y_x: x, y_p: pull}
      process_noise: {x: 1 1/s, v: 1 1/s}
      measurement_noise: {y_x: 1, y_p: 2 1/s^2}
outputs: [x, v]
"""


def made(folder: Path, *changes: tuple[str, str], model: str = MODEL) -> Program:
    text = OBSERVER
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return program(text, project_of(folder, m=model))


def test_the_matrices_are_the_derivatives_at_the_point(tmp_path: Path) -> None:
    (info,) = made(tmp_path).observers
    assert info.states == ("x", "v")
    assert info.inputs == ("u",)
    assert info.a == ((0.0, 0.5), (-1.5, -(0.5 + 3 * 2 * 1.5 / 2) / 2))
    assert info.b == ((0.0,), (0.5,))
    assert info.c == ((1.0, 0.0), (3.0, 0.5))


def test_what_remains_has_the_values_of_states_and_inputs_that_are_left_out(
    tmp_path: Path,
) -> None:
    """f = (k z + 3 sin(tilt) + more - bent(1.5) + bent'(1.5) 1.5) / p, more by its default."""
    inside = Interpreter(made(tmp_path))
    inside.run("step")
    inside.set("state.z", 0.8)
    inside.set("before.tilt", 0.3)
    inside.run("predict_only")
    bent = 3 * 1.5**2 / 2 - 3 * 1.5 * 1.5
    expected = (3 * 0.8 + 3 * 0.29552020666133955 + 0.25 - bent) / 2
    assert inside.get("work.f_v") == pytest.approx(expected, rel=1e-15)


def test_a_measured_equation_is_read_with_what_remains_of_it(tmp_path: Path) -> None:
    """The innovation of y_p is y_p - (k (x - z) + c v)."""
    inside = Interpreter(made(tmp_path))
    inside.run("step")
    for name, value in {"x": 2.0, "v": -1.0, "z": 0.25}.items():
        inside.set(f"state.{name}", value)
    inside.set("is_new.y_p", True)
    inside.set("input.y_p", 7.0)
    inside.run("correct_only")
    assert inside.get("innovation.y_p") == pytest.approx(7.0 - (3 * 1.75 - 0.5), rel=1e-15)


def test_the_estimator_has_the_numbers_of_the_written_one() -> None:
    taken, written = (lower_automaton(load_shipped(n)) for n in ("estimator", "estimator_written"))
    ours, theirs = (
        {k: v for k, v in solve_constants(p).items() if "_lin" not in k} for p in (taken, written)
    )
    numbers = [name for name in theirs if name.startswith("solved.")]
    more = ["solved.drive_f_constant.w_w", "solved.coast_f_constant.w_w"]
    assert [n for n in ours if n.startswith("solved.") and n not in more] == numbers
    for name in more:
        assert ours[name] == pytest.approx(-theirs["constant.b_0"] / ours["constant.J_v"], 1e-13)
    for name in numbers:
        assert ours[name] == pytest.approx(theirs[name], rel=1e-12), name


@pytest.mark.parametrize("mode", ["drive", "coast"])
def test_what_remains_is_that_of_the_written_estimator(mode: str) -> None:
    found = []
    for name in ("estimator", "estimator_written"):
        inside = Interpreter(program_of(load_shipped(name)))
        inside.run("step")
        inside.set("state.theta_b", 0.0123)
        inside.run(f"predict_{mode}")
        found.append([inside.get(f"work.f_{state}") for state in ("w_em", "w_w")])
    assert found[0] == pytest.approx(found[1], rel=1e-13)


def test_a_point_that_is_missing_is_asked_for(tmp_path: Path) -> None:
    (line,) = problem_lines(lambda: made(tmp_path, ("      at: {v: 1.5}\n", "")))
    assert line.endswith("A has no constant entry v, v: it depends on `v`")


def test_a_point_is_made_of_parameters(tmp_path: Path) -> None:
    (line,) = problem_lines(lambda: made(tmp_path, ("at: {v: 1.5}", "at: {v: z}")))
    assert line.endswith("A has no constant entry v, v: it depends on `z`")
    made(tmp_path, ("at: {v: 1.5}", "at: {v: p, x: z}"))


def test_a_state_that_is_left_out_stands_still(tmp_path: Path) -> None:
    (line,) = problem_lines(lambda: made(tmp_path, ("of: m.still", "of: m.moves")))
    assert "`z` moves in `m.moves`" in line


def test_what_a_balance_reads_has_a_value_here(tmp_path: Path) -> None:
    (line,) = problem_lines(lambda: made(tmp_path, ("  z: {initial: 0.5}\n", "")))
    assert line.endswith("the balance of `v` reads `z`, which has no value here")
    (line,) = problem_lines(lambda: made(tmp_path, ("u: {unit: 1/s}, ", "")))
    assert line.endswith("the balance of `v` reads `u`, which has no value here")


def test_matrices_are_taken_from_the_model_or_written_not_both(tmp_path: Path) -> None:
    lines = problem_lines(lambda: made(tmp_path, ("of: m.still", "of: m.still\n      f: {x: c}")))
    assert [line.partition(" ")[2] for line in lines] == [
        "`f` is taken from the model, because `of` is given"
    ]


def test_the_branch_taken_at_the_point_is_differentiated(tmp_path: Path) -> None:
    bent = MODEL.replace("k * v^2 / p", "if v > 1 then k * v else c * v")
    (info,) = made(tmp_path, model=bent).observers
    assert info.a[1][1] == -(0.5 + 3) / 2
    (info,) = made(tmp_path, ("at: {v: 1.5}", "at: {v: 0.5}"), model=bent).observers
    assert info.a[1][1] == -(0.5 + 0.5) / 2
    (line,) = problem_lines(lambda: made(tmp_path, ("at: {v: 1.5}", "at: {v: 1}"), model=bent))
    assert "no derivative there" in line
    (line,) = problem_lines(lambda: made(tmp_path, ("      at: {v: 1.5}\n", ""), model=bent))
    assert line.endswith("`v` decides which branch is taken")


def test_a_measure_is_of_one_unit(tmp_path: Path) -> None:
    lines = problem_lines(lambda: made(tmp_path, ("y_p: pull", "y_p: x")))
    assert any("`y_p` is in `1/s`" in line for line in lines)
    (line,) = problem_lines(lambda: made(tmp_path, ("y_p: pull", "y_p: puII")))
    assert "`y_p` measures `puII`" in line
