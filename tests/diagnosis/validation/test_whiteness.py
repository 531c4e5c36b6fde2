"""Whiteness: what is left of noise, and of noise that remembers, as formulas say it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from diagnosis.validation.whiteness import ljung_box

PERIOD = 0.005


def noise(count: int, seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, 2.0, count)


def test_noise_is_white_and_its_past_tells_nothing() -> None:
    found = ljung_box("w", [noise(4000), noise(3000, 4)], PERIOD)
    assert found.is_white
    assert found.predictable_fraction < 0.02
    assert found.rms == pytest.approx(2.0, rel=0.03)
    assert found.lags[[0, -1]] == pytest.approx([PERIOD, 0.25])
    assert found.lags_outside_band <= 3


def test_of_noise_with_a_memory_the_past_tells_the_square_of_its_correlation() -> None:
    """x(k) = a x(k-1) + e(k): correlations a^lag, and a^2 of the variance is told by the past."""
    a = 0.6
    x = lfilter([1.0], [1.0, -a], noise(20_000))
    found = ljung_box("w", [x], PERIOD)
    assert not found.is_white
    assert found.rating == "coloured"
    assert found.correlations[:3] == pytest.approx([a, a**2, a**3], abs=0.03)
    assert found.predictable_fraction == pytest.approx(a**2, abs=0.02)


def test_a_memory_too_small_to_matter_is_called_so() -> None:
    x = lfilter([1.0], [1.0, -0.1], noise(20_000))
    found = ljung_box("w", [x], PERIOD)
    assert not found.is_white
    assert found.rating == "nearly white"


def test_chance_is_spread_evenly_over_white_noise() -> None:
    chances = [ljung_box("w", [noise(800, seed)], PERIOD).p_value for seed in range(200)]
    assert np.mean(chances) == pytest.approx(0.5, abs=0.08)
    assert np.mean(np.array(chances) < 0.01) < 0.04


def test_what_is_not_known_is_not_counted() -> None:
    x = lfilter([1.0], [1.0, -0.6], noise(40_000))
    x[np.random.default_rng(1).random(len(x)) < 0.5] = np.nan
    found = ljung_box("w", [x], PERIOD)
    assert found.correlations[0] == pytest.approx(0.6, abs=0.04)
