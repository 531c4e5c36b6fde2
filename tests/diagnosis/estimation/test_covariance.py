"""Standard errors include the correlation of errors and the uncertainty of initial states."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.covariance import correlations_of, long_run_variance

SAMPLES, RUNS = 20_000, 3


def autoregression(pole: float) -> list[np.ndarray]:
    """Return series of x(t) = pole x(t - 1) + e(t) with unit variance of e."""
    random = np.random.default_rng(4)
    noise = random.standard_normal((RUNS, SAMPLES))
    for t in range(1, SAMPLES):
        noise[:, t] += pole * noise[:, t - 1]
    return list(noise)


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9, -0.5])
def test_long_run_variance_of_an_autoregression(pole: float) -> None:
    expected = RUNS * SAMPLES / (1.0 - pole) ** 2
    assert long_run_variance(autoregression(pole)) == pytest.approx(expected, rel=0.15)


def test_zeros_have_no_variance() -> None:
    assert long_run_variance([np.zeros(5), np.zeros(7)]) == 0.0


def test_correlations_are_in_descending_order() -> None:
    covariance = np.array([[4.0, 1.0, -3.6], [1.0, 1.0, 0.0], [-3.6, 0.0, 4.0]])
    found = correlations_of(covariance, ["a", "b", "c"])
    assert list(found) == [("a", "c"), ("a", "b"), ("b", "c")]
    assert found["a", "c"] == pytest.approx(-0.9)
