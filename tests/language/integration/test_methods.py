"""Methods: order of each, its polynomial inside the step, its largest stable step; one flow."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

from engine.interpreter.interpreter import Interpreter
from language.integration.stability_limit import largest_stable_step
from language.ir.program import Program, StabilityLimit
from language.loading.load import automaton_of, program_of
from language.overlays.expand_document import read_document
from tests.language.continuous_model import Flow
from tests.language.spec_builders import problem_lines, project_of, raised_problems

BERNOULLI = "x: der(x) = -2 1/s * x + 3 1/s * x^2"
ORDERS = {"euler": 1, "midpoint": 2, "rk4": 4}


def bernoulli(t: float) -> float:
    """Return x of x' = -2 x + 3 x^2 from 0.5: 1/x = 3/2 + (1/x0 - 3/2) e^(2 t) (Bernoulli 1695)."""
    return 1 / (1.5 + 0.5 * math.exp(2 * t))


def after_one_second(folder: Path, method: str, substeps: int) -> float:
    made = Flow(folder, BERNOULLI, {"x": 0.5}).program(substeps=substeps, method=method)
    inside = Interpreter(made)
    inside.run("step")
    inside.run("step")
    return float(inside.get("state.x"))


@pytest.mark.parametrize("method", ORDERS)
def test_a_method_has_its_order(tmp_path: Path, method: str) -> None:
    counts = (12, 24, 48, 96)
    errors = [abs(after_one_second(tmp_path, method, n) - bernoulli(1.0)) for n in counts]
    for a, b in itertools.pairwise(errors):
        assert math.log2(a / b) == pytest.approx(ORDERS[method], abs=0.2)


@pytest.mark.parametrize("method", ORDERS)
def test_the_polynomial_inside_a_step_has_the_order_of_the_method(
    tmp_path: Path, method: str
) -> None:
    """The error at a third of the step shrinks with h^(p + 1) (with h^4 for the cubic of rk4)."""
    never = "never: {to: one, when: x < -4, reset: {x: 0}}"
    made = Flow(tmp_path, BERNOULLI, {"x": 0.5}, leave=never).program(method=method)
    errors = []
    for h in (0.1, 0.05, 0.025):
        inside = Interpreter(made)
        inside.run("step")
        inside.set("work.h", h)
        inside.run("step_one")
        inside.run("series_one")
        for s, at in ((0.0, 0.5), (h, inside.get("work.end_x"))):
            inside.set("work.s", s)
            inside.run("point")
            assert inside.get("work.at_x") == pytest.approx(at, rel=1e-15)
        inside.set("work.s", h / 3)
        inside.run("point")
        errors.append(abs(inside.get("work.at_x") - bernoulli(h / 3)))
    for a, b in itertools.pairwise(errors):
        assert math.log2(a / b) == pytest.approx(min(ORDERS[method] + 1, 4), abs=0.35)


def test_exact_takes_affine_flows_only_and_lists_the_other_terms(tmp_path: Path) -> None:
    (problem,) = raised_problems(
        lambda: Flow(tmp_path, BERNOULLI, {"x": 0.5}).program(method="exact")
    )
    assert problem.label == (
        "the flow of mode `one` is not linear in the states with constant coefficients: "
        "`3 1/s * x^2`"
    )
    bent = "x: der(x) = -u * x + abs(x) * 1 1/s + 2 1/s * x - u"
    (problem,) = raised_problems(lambda: Flow(tmp_path, bent, {"x": 0.5}).program(method="exact"))
    assert problem.label.endswith("coefficients: `-u * x`, `abs(x) * 1 1/s`")
    assert not raised_problems(
        lambda: Flow(tmp_path, "x: der(x) = u - 1 1/s * x", {"x": 0.5}).program()
    )


# The largest stable step.

DRIVELINE = """language: 1
variant: other
extends: estimator
period: {period}
modes: {{gap: {{runs: {{method: {method}, substeps: 1{more}}}}}}}
"""
ALONE = ", follow: false"


def driveline(folder: Path, method: str, period: str, more: str = "") -> Program:
    project = project_of(folder, other=DRIVELINE.format(method=method, period=period, more=more))
    return program_of(automaton_of(read_document(project.path_of("other")), project))


def limit(made: Program, mode: str) -> StabilityLimit:
    assert made.integration
    (found,) = [limit for limit in made.integration.stability_limits if limit.mode == mode]
    return found


@pytest.mark.parametrize(
    ("method", "times"), [("euler", 2.0), ("midpoint", 2.0), ("rk4", 2.7852935634052818)]
)
def test_the_gap_of_the_paper_has_the_limits_of_its_pole(
    tmp_path: Path, method: str, times: float
) -> None:
    """Pole -k/c = -343 1/s: Euler and midpoint 2 c/k, RK4 2.785 c/k (their regions, real axis)."""
    found = limit(driveline(tmp_path, method, "1 ms", ALONE), "no_contact")
    assert found.step == pytest.approx(times * 14 / 4800, rel=1e-9)
    assert found.eigenvalue == pytest.approx(-4800 / 14, rel=1e-12)
    assert (found.term, found.state) == ("k_hs / c_hs * (theta_d - theta_b)", "theta_b")


def test_eulers_contact_oscillation_grows_beyond_c_over_k(tmp_path: Path) -> None:
    """h <= -2 Re(lambda)/|lambda|^2 for lambda = -2.21822 +- 38.76527 i: 2.943 ms, near c/k."""
    found = limit(driveline(tmp_path, "euler", "1 ms"), "drive_contact")
    pole = complex(-2.2182233954181343, 38.76527278582127)
    assert found.step == pytest.approx(-2 * pole.real / abs(pole) ** 2, rel=1e-4)


def test_the_model_of_the_paper_cannot_run_at_10_ms(tmp_path: Path) -> None:
    """And the reason is named; 8 ms is below 2.785 c/k = 8.123 ms."""
    (problem,) = raised_problems(lambda: driveline(tmp_path, "rk4", "10 ms"))
    assert problem.label == (
        "`rk4` is not stable in mode `no_contact` with a step of 0.01 s: the largest is 0.008124 s"
    )
    assert problem.help == (
        "`k_hs / c_hs * (theta_d - theta_b)` sets the eigenvalue of 342.9 1/s in the rate of "
        "`theta_b`: 2 times as many steps, or `method: exponential`"
    )
    driveline(tmp_path, "rk4", "8 ms")


def test_a_continuous_automaton_has_the_limit_of_its_step(tmp_path: Path) -> None:
    body = """language: 1
automaton: m
step: {step} ms
states: {{x: {{unit: "1", initial: 1}}}}
modes: {{one: {{flow: {{x: der(x) = -100 1/s * x}}}}}}
"""

    def made(step: int) -> None:
        project = project_of(tmp_path, m=body.format(step=step))
        program_of(automaton_of(read_document(project.path_of("m")), project))

    made(27)
    (line,) = problem_lines(lambda: made(28))
    assert "with a step of 0.028 s: the largest is 0.02785 s" in line


@pytest.mark.parametrize("flow", ["x: der(x) = 50 1/s * x", "x: der(x) = u"])
def test_what_does_not_decay_sets_no_limit(tmp_path: Path, flow: str) -> None:
    assert not raised_problems(lambda: Flow(tmp_path, flow, {"x": 1.0}).program(method="euler"))


def test_an_oscillation_is_limited_by_the_imaginary_part_too() -> None:
    """|R(i y)| = 1 of RK4 at y = 2 sqrt(2); midpoint and Euler have no such stretch."""
    nearly = complex(-2e-6, 1.0)
    assert largest_stable_step("rk4", nearly) == pytest.approx(2 * math.sqrt(2), rel=1e-4)
    assert largest_stable_step("euler", complex(-0.1, 1.0)) == pytest.approx(0.2 / 1.01, rel=1e-9)


# One flow, without transitions.


@pytest.mark.parametrize("method", [*ORDERS, "exact", "exponential"])
def test_one_flow_passes_a_guard_of_the_model(tmp_path: Path, method: str) -> None:
    flow = Flow(tmp_path, "x: der(x) = u", {"x": 0.0}, leave="two: {when: x >= 0.5}",
                other="x: der(x) = 0")  # fmt: skip
    for more, x in (("", 0.5), (", follow: false", 2.0)):
        inside = Interpreter(flow.program(method=f"{method}{more}", substeps=2))
        inside.set("input.u", 1.0)
        for _ in range(3):
            inside.run("step")
        assert inside.get("state.x") == pytest.approx(x, rel=1e-7)


@pytest.mark.parametrize("more", ["", ", follow: false"])
def test_a_run_ends_within_the_ranges_of_its_states(tmp_path: Path, more: str) -> None:
    made = Flow(tmp_path, "x: der(x) = u", {"x": 0.0}).program(method=f"euler{more}", substeps=2)
    inside = Interpreter(made)
    inside.set("input.u", 4.0)
    for x in (0.0, 4.0, 5.0, 5.0):
        inside.run("step")
        assert inside.get("state.x") == x
    assert made.faults and inside.get("memory.faults") != 0


def test_runs_of_one_automaton_share_their_method(tmp_path: Path) -> None:
    flow = Flow(tmp_path, "x: der(x) = u", {"x": 0.0})
    flow.program()
    clock = """language: 1
automaton: s
period: 1 s
model: m
numbers: float64
inputs: {u: {unit: 1/s, default: 0 1/s}}
states: {x: {unit: "1", initial: 0, range: [-5, 5]}}
initial: go
modes:
  go: {runs: {of: m.one, method: rk4}, transitions: {rest: {when: x > 1}}}
  rest: {runs: {of: m.one, method: euler}}
"""
    project = project_of(tmp_path, s=clock)
    lines = problem_lines(
        lambda: program_of(automaton_of(read_document(project.path_of("s")), project))
    )
    assert any("one method, one number of substeps" in line for line in lines)
