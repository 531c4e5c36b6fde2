"""Matrix routines against scipy and filterpy, relative to the largest entry of each matrix."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from filterpy.common import van_loan_discretization
from hypothesis import example, given, strategies as st
from numpy.typing import NDArray

from language.numerics.matrix import (
    Matrix,
    expm,
    expm_integral,
    identity,
    multiply,
    solve,
    transpose,
)
from language.numerics.riccati import discretise_noise, steady_kalman_gain

CLOSE = 1e-9
"""Asked of every number that is printed into C; measured differences are below 1e-11."""
entries = st.floats(-3.0, 3.0, allow_nan=False)


@st.composite
def squares(draw: st.DrawFn) -> Matrix:
    """Matrices 1 x 1 to 4 x 4 whose states have scales from 2^-8 to 2^8."""
    n = draw(st.integers(1, 4))
    scales = [2.0 ** draw(st.integers(-8, 8)) for _ in range(n)]
    return tuple(tuple(draw(entries) * scales[i] / scales[j] for j in range(n)) for i in range(n))


def near(ours: Matrix, theirs: NDArray[np.float64]) -> None:
    largest = max(float(np.abs(theirs).max()), 1e-300)
    assert float(np.abs(np.array(ours) - theirs).max()) <= CLOSE * largest


@given(squares(), st.floats(0.001, 1.0))
def test_the_exponential_is_that_of_scipy(a: Matrix, h: float) -> None:
    near(expm(a, h), scipy.linalg.expm(np.array(a) * h))


@given(squares(), st.floats(0.001, 1.0))
def test_its_integral_is_the_corner_of_the_augmented_exponential(a: Matrix, h: float) -> None:
    n = len(a)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:] = np.array(a) * h, np.eye(n) * h
    near(expm_integral(a, h), scipy.linalg.expm(block)[:n, n:])


@given(squares(), st.floats(0.001, 0.1))
@example(((0.0, 2.2e-311), (1.0, 0.0)), 0.0625)
def test_the_noise_of_a_period_is_that_of_van_loan(a: Matrix, h: float) -> None:
    n = len(a)
    density = tuple(tuple(float(i == j) * (i + 1) for j in range(n)) for i in range(n))
    root = np.sqrt(np.array(density))
    _, expected = van_loan_discretization(np.array(a), root, h)
    found = discretise_noise(a, density, h)
    near(found, expected)
    assert found == transpose(found)


@given(squares())
def test_the_steady_gain_is_that_of_the_riccati_equation(a: Matrix) -> None:
    n, h = len(a), 0.01
    phi, seen = expm(a, h), identity(n)
    noise = discretise_noise(a, identity(n), h)
    gain, covariance = steady_kalman_gain(phi, noise, seen, identity(n))
    f, q, r = np.array(phi), np.array(noise), np.eye(n)
    p = scipy.linalg.solve_discrete_are(f.T, np.eye(n), q, r)
    near(covariance, p)
    near(gain, p @ np.linalg.inv(p + r))


def test_a_solution_solves_and_a_singular_matrix_is_refused() -> None:
    a, b = ((0.0, 2.0), (3.0, 1.0)), ((4.0,), (5.0,))
    assert multiply(a, solve(a, b)) == b
    with pytest.raises(ValueError, match="solve"):
        solve(((1.0, 2.0), (2.0, 4.0)), b)


def test_a_state_that_nobody_sees_and_that_grows_has_no_gain() -> None:
    phi = ((1.0, 0.0), (0.0, 1.01))
    with pytest.raises(ValueError, match="steady_gain"):
        steady_kalman_gain(phi, identity(2), ((1.0, 0.0),), ((1.0,),))
