"""Recursive: covariance, gain and states of a recursive observer against filterpy."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
import pytest
from filterpy.common import van_loan_discretization
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray
from scipy.linalg import expm

from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from lockstep.comparison import compare
from tests.language.spec_builders import program
from tests.lockstep.program_strategies import record_ticks

TOLERANCE = 1e-9
"""Of the largest value: semantics, rule 17."""
Matrix = NDArray[np.float64]
STATES = ("x", "v", "b")
A = np.array([[0.0, 1.0, 0.0], [-4.0, -0.3, 1.0], [0.0, 0.0, -0.1]])
C = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
R = (0.04, 0.25)
Q = (0.0, 0.5, 0.2)

SPEC = """language: 1
automaton: r
period: 0.1 s
numbers: float64
inputs: {y_x: {unit: "1"}, y_v: {unit: 1/s}, u: {unit: 1/s^2}, ok: {type: bool, default: true}}
states: {x: {unit: "1", initial: 0}, v: {unit: 1/s, initial: 0}, b: {unit: 1/s^2, initial: 0}}
initial: on_1
modes:
  on_1:
    observer:
      kalman: {states: [x, v, b], gain: recursive, covariance: keep}
      correct: ok
      inputs: [u]
      A: {x: {v: 1}, v: {x: -4 1/s^2, v: -0.3 1/s, b: 1}, b: {b: -0.1 1/s}}
      B: {v: {u: 1}}
      C: {y_x: {x: 1}, y_v: {v: 2}}
      measures: {y_x: x, y_v: v}
      process_noise: {v: 0.5 1/s^3, b: NOISE}
      measurement_noise: {y_x: 0.04, y_v: 0.25 1/s^2}
    transitions: {on_2: {when: x > 1000}}
  on_2: {}
outputs: [x, v, b]
"""
CONSTANT = "0.2 1/s^5"
VARYING = "0.2 1/s^5 + 3 1/s * (u - previous(u))^2"


def make_program(*changes: tuple[str, str], noise: str = CONSTANT) -> Program:
    text = SPEC.replace("NOISE", noise)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return program(text)


def ticks(count: int) -> list[dict[str, float | bool]]:
    """Return inputs of some ticks: noise, a step of u, ticks without y_v and without both."""
    random = np.random.default_rng(7)
    return [
        {
            "y_x": float(random.normal()),
            "y_v": float(random.normal()),
            "u": 0.0 if k < 9 else 1.5,
            "ok": k % 5 != 3,
            "new": k % 4 != 2,
        }
        for k in range(count)
    ]


def covariance(inside: Interpreter) -> Matrix:
    found = np.zeros((3, 3))
    for i, row in enumerate(STATES):
        for j, column in enumerate(STATES[i:], start=i):
            found[i, j] = found[j, i] = inside.get(f"memory.P_{row}__{column}")
    return found


def step(inside: Interpreter, given: Mapping[str, float | bool]) -> None:
    for name, value in given.items():
        if name != "new":
            inside.set(f"input.{name}", value)
    inside.set("is_new.y_x", True)
    inside.set("is_new.y_v", bool(given["new"]))
    inside.run("step")


def filterpy_at(x: Matrix, p: Matrix, density: float) -> KalmanFilter:
    theirs = KalmanFilter(dim_x=3, dim_z=1, dim_u=1)
    spectral = np.diag([0.0, Q[1], density])
    theirs.F, theirs.Q = van_loan_discretization(A, np.sqrt(spectral), 0.1)
    block = np.zeros((4, 4))
    block[:3, :3], block[1, 3] = A, 1.0
    theirs.B = expm(block * 0.1)[:3, 3:]
    theirs.x, theirs.P = x.reshape(3, 1).copy(), p.copy()
    return theirs


@pytest.mark.parametrize("noise", [CONSTANT, VARYING])
def test_it_is_filterpy_tick_by_tick(noise: str) -> None:
    inside = Interpreter(make_program(noise=noise))
    series = ticks(60)
    step(inside, series[0])
    for before, now in itertools.pairwise(series):
        x = np.array([inside.get(f"state.{name}") for name in STATES])
        jump = float(now["u"]) - float(before["u"])
        density = Q[2] + (3 * jump**2 if noise == VARYING else 0.0)
        theirs = filterpy_at(x, covariance(inside), density)
        theirs.predict(u=np.array([[before["u"]]]))
        for k, name in enumerate(("y_x", "y_v")):
            if now["ok"] and (k == 0 or now["new"]):
                theirs.update(np.array([[now[name]]]), R=np.array([[R[k]]]), H=C[k : k + 1])
        step(inside, now)
        for row, name in enumerate(STATES):
            assert inside.get(f"state.{name}") == pytest.approx(theirs.x[row, 0], abs=TOLERANCE)
        ours = covariance(inside)
        assert np.max(np.abs(ours - theirs.P)) <= TOLERANCE * np.max(np.abs(ours))


def test_without_gaps_it_stays_in_the_steady_state() -> None:
    """It starts with the steady covariance of before a correction, so nothing ever changes."""
    inside = Interpreter(make_program())
    steady = Interpreter(make_program(("gain: recursive, covariance: keep", "gain: steady")))
    first = np.zeros((3, 3))
    for k, given in enumerate(ticks(40)):
        for one in (inside, steady):
            step(one, {**given, "ok": True, "new": True})
        first = covariance(inside) if k == 0 else first
        assert np.allclose(covariance(inside), first, rtol=1e-12, atol=1e-15)
        for name in STATES:
            assert inside.get(f"state.{name}") == pytest.approx(
                steady.get(f"state.{name}"), rel=1e-9, abs=1e-12
            )


def test_the_innovation_is_that_of_the_prediction_and_0_without_a_measurement() -> None:
    inside = Interpreter(make_program())
    for given in ticks(12):
        step(inside, given)
        if not given["ok"]:
            assert inside.get("innovation.y_x") == inside.get("innovation.y_v") == 0.0
        elif not given["new"]:
            assert inside.get("innovation.y_v") == 0.0 != inside.get("innovation.y_x")
        else:
            assert inside.get("innovation.y_v") != 0.0


COMING_BACK = (
    ("on_2: {when: x > 1000}", "on_2: {when: u > 1 1/s^2}"),
    ("  on_2: {}", "  on_2: {transitions: {on_1: {when: u < 1 1/s^2}}}"),
)


@pytest.mark.parametrize("kept", [True, False])
def test_covariance_is_kept_across_modes_or_steady_on_entry(kept: bool) -> None:
    changes = COMING_BACK if kept else (*COMING_BACK, ("keep", "steady"))
    inside = Interpreter(make_program(*changes))
    calm = {"y_x": 0.0, "y_v": 0.0, "u": 0.0, "ok": True, "new": True}
    step(inside, calm)
    first = covariance(inside)
    for _ in range(3):
        step(inside, {**calm, "ok": False})
    step(inside, {**calm, "ok": False, "u": 2.0})
    grown = covariance(inside)
    assert grown[0, 0] > 1.5 * first[0, 0]
    step(inside, calm)
    assert inside.get("memory.mode") == 0
    assert np.allclose(covariance(inside), grown if kept else first, rtol=1e-12)


def test_variances_stay_within_their_limits_with_a_fault() -> None:
    limits = "covariance: keep, covariance_range: {x: [0.001, 0.05], v: [0.01 1/s^2, 0.095 1/s^2]}"
    used = make_program(("covariance: keep", limits))
    inside = Interpreter(used)
    bit = 1 << used.faults.index("covariance_range")
    calm = {"y_x": 0.0, "y_v": 0.0, "u": 0.0, "ok": True, "new": True}
    step(inside, calm)
    assert not inside.get("memory.faults") & bit
    for _ in range(30):
        step(inside, {**calm, "ok": False})
    assert inside.get("memory.faults") & bit
    p = covariance(inside)
    assert p[0, 0] == 0.05 and p[1, 1] == 0.095
    assert abs(p[0, 1]) <= np.sqrt(0.05 * 0.095)
    inside.set("memory.P_x__x", float("nan"))
    step(inside, {**calm, "ok": False})
    assert inside.get("memory.P_x__x") == 0.001


@pytest.mark.parametrize("numbers", ["float64", "float32"])
@pytest.mark.parametrize("noise", [CONSTANT, VARYING])
def test_engine_and_c_are_equal(numbers: str, noise: str) -> None:
    limits = "covariance: keep, covariance_range: {x: [0.001, 0.05], v: [0.01 1/s^2, 0.095 1/s^2]}"
    change = (*COMING_BACK, ("covariance: keep", limits), ("float64", numbers))
    series = ticks(40)
    special = [-0.0, 5e-324, 1e30, float("nan"), float("inf")]
    for given, value in zip(series[30:], special, strict=False):
        given["y_x"] = value
    inputs = [{f"input.{n}": v for n, v in given.items() if n != "new"} for given in series]
    for given, one in zip(series, inputs, strict=True):
        one.update({"is_new.y_x": True, "is_new.y_v": given["new"]})
    verdict = compare(record_ticks(make_program(*change, noise=noise), inputs))
    assert verdict.is_equal and verdict.transitions > 0, verdict
