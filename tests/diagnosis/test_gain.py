"""The gain is that of scipy's Riccati solver; the first gains end where the steady one is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from diagnosis.gain import Linear, first_gains, steady_gain

RNG = np.random.default_rng(5)


def system(states: int, seen: int) -> tuple[Linear, np.ndarray, np.ndarray]:
    phi = RNG.normal(size=(states, states))
    phi *= 0.98 / np.max(np.abs(np.linalg.eigvals(phi)))
    c = RNG.normal(size=(seen, states))
    q = np.diag(RNG.uniform(0.01, 1.0, states))
    r = np.diag(RNG.uniform(0.1, 1.0, seen))
    return Linear(phi, c, np.zeros((states, 1))), q, r


@pytest.mark.parametrize(("states", "seen"), [(1, 1), (3, 1), (7, 2)])
def test_the_steady_gain_is_that_of_the_riccati_equation(states: int, seen: int) -> None:
    linear, q, r = system(states, seen)
    p = solve_discrete_are(linear.phi.T, linear.c.T, q, r)
    wanted = p @ linear.c.T @ np.linalg.inv(linear.c @ p @ linear.c.T + r)
    gain = steady_gain(linear, q, r)
    assert gain is not None
    assert np.allclose(gain, wanted, rtol=1e-9, atol=1e-12)


def test_the_first_gains_become_the_steady_one() -> None:
    linear, q, r = system(4, 2)
    gains = first_gains(linear, q, r, 100.0 * np.eye(4), 400)
    steady = steady_gain(linear, q, r)
    assert steady is not None
    assert np.allclose(gains[-1], steady, rtol=1e-6, atol=1e-9)
    assert np.linalg.norm(gains[0]) > np.linalg.norm(steady)


def test_without_noise_nothing_is_corrected() -> None:
    linear, _, r = system(3, 1)
    gain = steady_gain(linear, np.zeros((3, 3)), r)
    assert gain is not None
    assert np.allclose(gain, 0.0, atol=1e-9)
