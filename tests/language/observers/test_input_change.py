"""Instant: what a change at an unknown instant does, against quadrature and scipy's exponential."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import quad_vec
from scipy.linalg import expm

from engine.interpreter.interpreter import Interpreter
from language.observers.input_change import change_moments
from lockstep.comparison import compare
from tests.language.observers.test_recursive_kalman import (
    STATES,
    A,
    Matrix,
    covariance,
    make_program,
    step,
    ticks,
)
from tests.lockstep.program_strategies import record_ticks

B = np.array([[0.0], [1.0], [0.0]])


def response(a: Matrix, b: Matrix, time: float) -> Matrix:
    """Return g(s), (n,): what a change by 1 that was s ago has done."""
    n = len(a)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n:] = a, b
    found: Matrix = expm(block * time)[:n, n]
    return found


def theirs(a: Matrix, b: Matrix, time: float) -> tuple[Matrix, Matrix]:
    mean = quad_vec(lambda s: response(a, b, s), 0.0, time)[0] / time
    second = quad_vec(lambda s: np.outer(response(a, b, s), response(a, b, s)), 0.0, time)[0] / time
    return mean, second - np.outer(mean, mean)


@settings(max_examples=10)
@given(
    st.lists(st.floats(-20.0, 20.0), min_size=6, max_size=6),
    st.floats(1e-3, 0.2),
)
def test_moments_are_those_of_quadrature(entries: list[float], time: float) -> None:
    a, b = np.array(entries[:4]).reshape(2, 2), np.array(entries[4:]).reshape(2, 1)
    mean, spread = (
        np.array(m) for m in change_moments(tuple(map(tuple, a)), tuple(map(tuple, b)), time)
    )
    wanted, covered = theirs(a, b, time)
    assert np.allclose(mean[:, 0], wanted, rtol=1e-9, atol=1e-9 * np.max(np.abs(wanted)))
    size = np.max(np.abs(covered + np.outer(wanted, wanted)))
    assert np.allclose(spread, covered, rtol=0.0, atol=1e-9 * size)
    assert np.array_equal(spread, spread.T)


def test_a_tick_adds_mean_and_covariance_of_the_change() -> None:
    """Beside the same observer without it, from the same states, with no measurement."""
    within = make_program(("process_noise", "unknown_instant: {u: 0.25 s}\n      process_noise"))
    one, other = Interpreter(within), Interpreter(make_program())
    calm = {"y_x": 0.3, "y_v": 0.1, "u": 1.0, "ok": True, "new": True}
    for inside in (one, other):
        step(inside, calm)
        step(inside, {**calm, "ok": False, "u": 1.0})
    mean, spread = theirs(A, B, 0.25)
    for u, change in ((1.0, 0.0), (-1.5, -2.5)):
        for inside in (one, other):
            step(inside, {**calm, "ok": False, "u": u})
        for row, name in enumerate(STATES):
            more = one.get(f"state.{name}") - other.get(f"state.{name}")
            assert more == pytest.approx(change * mean[row], abs=1e-12)
        assert np.allclose(covariance(one) - covariance(other), change**2 * spread, atol=1e-12)


@pytest.mark.parametrize("numbers", ["float64", "float32"])
def test_engine_and_c_are_equal(numbers: str) -> None:
    within = ("process_noise", "unknown_instant: {u: 0.25 s}\n      process_noise")
    series = ticks(40)
    for given_now, value in zip(series[20:], [-0.0, 1e30, float("nan"), 5e-324], strict=False):
        given_now["u"] = value
    inputs = [{f"input.{n}": v for n, v in one.items() if n != "new"} for one in series]
    for one, now in zip(series, inputs, strict=True):
        now.update({"is_new.y_x": True, "is_new.y_v": one["new"]})
    assert compare(record_ticks(make_program(within, ("float64", numbers)), inputs)).is_equal
