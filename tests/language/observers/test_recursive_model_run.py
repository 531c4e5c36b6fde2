"""A recursive observer whose run predicts, and what does not go together with one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from filterpy.common import van_loan_discretization

from engine.interpreter.interpreter import Interpreter
from language.ir.ops import Block, Branch, Compare, Loop, Ref, RunBlock, Value
from language.ir.traversal import walk_ops
from lockstep.comparison import compare
from modewright.api.simulation import program as shipped_program
from tests.language.observers.test_recursive_kalman import CONSTANT, SPEC, make_program
from tests.language.spec_builders import problem_lines, program, project_of
from tests.lockstep.program_strategies import record_ticks

OBSERVING = """  on_2:
    observer:
      kalman: {{states: {states}, gain: recursive, covariance: keep}}
      A: {{x: {{v: 1}}, v: {{x: -4 1/s^2, v: -0.3 1/s, b: 1}}, b: {{b: -0.1 1/s}}}}
      measures: {{y_x: x}}
      process_noise: {{v: 0.5 1/s^3, b: 0.2 1/s^5}}
      measurement_noise: {{y_x: 0.04}}
"""

# The run predicts.

MODEL = """language: 1
automaton: m
parameters: {k: {value: 4 1/s^2}, d: {value: 0.3 1/s}}
inputs: {u: {unit: 1/s^2, default: 0 1/s^2}}
states:
  x: {unit: "1", initial: 0, range: [-50, 50]}
  v: {unit: 1/s, initial: 0, range: [-50, 50]}
flow: {x: der(x) = v}
initial: free
modes:
  free:
    flow: {v: der(v) = u - d * v}
    transitions: {held: {when: x >= 1}}
  held:
    flow: {v: der(v) = u - k * x - d * v}
"""
HYBRID = """language: 1
automaton: h
period: 0.1 s
numbers: float64
model: m
inputs: {y_x: {unit: "1"}, u: {unit: 1/s^2}}
states: {x: {initial: 0, range: [-50, 50]}, v: {initial: 0.8 1/s, range: [-50, 50]}}
modes:
  only:
    runs: {of: m.free, method: exponential}
    observer:
      kalman: {states: [x, v], gain: recursive, covariance: keep}
      predict: runs
      measures: {y_x: x}
      process_noise: {x: 0.01 1/s, v: 0.5 1/s^3}
      measurement_noise: {y_x: 0.04}
outputs: [x, v]
"""

V_HELD = "v: {initial: 0.8 1/s, range: [-0.9, 0.9]}"


def test_the_run_predicts_and_its_mode_spreads_the_covariance(tmp_path: Path) -> None:
    inside = Interpreter(program(HYBRID, project_of(tmp_path, m=MODEL)))
    phases = {0: np.array([[0.0, 1.0], [0.0, -0.3]]), 1: np.array([[0.0, 1.0], [-4.0, -0.3]])}
    inside.set("is_new.y_x", False)
    seen = set()
    inside.run("step")
    for _ in range(25):
        mode = inside.get("memory.run_mode")
        seen.add(mode)
        phi, q = van_loan_discretization(phases[mode], np.sqrt(np.diag([0.01, 0.5])), 0.1)
        names = ("memory.P_x__x", "memory.P_x__v", "memory.P_v__v")
        xx, xv, vv = (inside.get(name) for name in names)
        expected = phi @ np.array([[xx, xv], [xv, vv]]) @ phi.T + q
        x, v = inside.get("state.x"), inside.get("state.v")
        inside.run("step")
        found = np.array([inside.get(name) for name in names])
        assert np.allclose(found, [expected[0, 0], expected[0, 1], expected[1, 1]], rtol=1e-10)
        if inside.get("memory.run_mode") == mode:
            ahead = phi @ np.array([x, v])
            assert inside.get("state.x") == pytest.approx(ahead[0], rel=1e-12, abs=1e-12)
    assert seen == {0, 1}


def test_a_run_that_predicts_is_equal_in_c(tmp_path: Path) -> None:
    used = program(HYBRID, project_of(tmp_path, m=MODEL))
    inputs = [
        {"input.y_x": 0.08 * k, "input.u": 0.5 * (k % 3), "is_new.y_x": k % 2 == 0}
        for k in range(30)
    ]
    assert compare(record_ticks(used, inputs)).is_equal


def test_what_does_not_go_together_is_refused(tmp_path: Path) -> None:
    project = project_of(tmp_path, m=MODEL)

    def lines(old: str, new: str) -> list[str]:
        assert old in HYBRID
        return problem_lines(lambda: program(HYBRID.replace(old, new), project))

    (line,) = lines("gain: recursive, covariance: keep", "gain: steady")
    assert "`predict: runs` needs `gain: recursive`" in line
    (line,) = lines("      predict: runs\n", "")
    assert "has both `observer` and `runs`" in line
    assert lines("    runs: {of: m.free, method: exponential}\n", "")
    (line,) = lines("      predict: runs\n", "      predict: runs\n      correct: u\n")
    assert "`correct` names an input of type bool, `u` is none" in line
    assert problem_lines(
        lambda: make_program(("gain: recursive, covariance: keep", "covariance: keep"))
    )
    change = ("initial: on_1", "equations: {w: u * 1}\ninitial: on_1")
    (line,) = problem_lines(lambda: make_program(change, noise="0.2 1/s^5 + 0 1/s^3 * w"))
    assert line.endswith("`w` is an equation: an observer reads states and inputs")
    other = OBSERVING.format(states="[v, x, b]")
    (line,) = problem_lines(lambda: make_program(("  on_2: {}", other)))
    assert line.endswith("observers of an automaton have the same states in the same order")
    program(
        SPEC.replace("NOISE", CONSTANT).replace("  on_2: {}", OBSERVING.format(states="[x, v, b]"))
    )


# A run by rk4 has ends that an interval knows.


def blocks_by(method: str, folder: Path) -> dict[str, Block]:
    text = HYBRID.replace("method: exponential", f"method: {method}")
    return dict(program(text, project_of(folder, m=MODEL)).blocks)


def test_a_run_by_rk4_holds_states_after_each_segment(tmp_path: Path) -> None:
    blocks = blocks_by("rk4", tmp_path)
    (loop,) = (op for op in blocks["run_only"] if isinstance(op, Loop))
    assert RunBlock("saturate_states") in tuple(walk_ops(loop.body))
    assert "saturate_states" not in blocks_by("exponential", tmp_path)


@pytest.mark.parametrize(("method", "least"), [("rk4", 0.1 * 2.0**-60), ("exponential", 0.0)])
def test_a_rest_that_a_cubic_is_divided_by_has_a_least_size(
    method: str, least: float, tmp_path: Path
) -> None:
    (loop,) = (op for op in blocks_by(method, tmp_path)["run_only"] if isinstance(op, Loop))
    (test,) = (op.condition for op in loop.body if isinstance(op, Branch))
    assert test == Compare(">", Ref("work.left"), Value(least))


def test_a_run_by_rk4_is_equal_in_c_where_it_leaves_its_ranges(tmp_path: Path) -> None:
    text = HYBRID.replace("method: exponential", "method: rk4")
    text = text.replace("v: {initial: 0.8 1/s, range: [-50, 50]}", V_HELD)
    used = program(text, project_of(tmp_path, m=MODEL))
    inputs = [
        {"input.y_x": 0.08 * k, "input.u": 3.0 * (k % 3), "is_new.y_x": k % 2 == 0}
        for k in range(30)
    ]
    tape = record_ticks(used, inputs)
    assert compare(tape).is_equal
    inside = Interpreter(used)
    for given in inputs:
        for name, value in given.items():
            inside.set(name, value)
        inside.run("step")
        assert abs(inside.get("state.v")) <= 0.9
    assert int(inside.get("memory.faults")) & 1 << used.faults.index("range_v")


# Limits of a covariance.


def test_modes_with_the_same_limits_share_what_keeps_them() -> None:
    blocks = shipped_program("hko").blocks
    assert [name for name in blocks if name.startswith("bound_")] == ["bound_drive"]
    for mode in ("drive", "gap", "coast"):
        assert blocks[f"correct_{mode}"][-1] == RunBlock("bound_drive")
