"""Noise is told from what moves slowly; a quantised signal has at least that of its steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from diagnosis.data.noise_estimate import noise_of, quantum_of

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("size", [0.02, 0.5])
def test_white_noise_on_a_slow_signal_is_found(size: float) -> None:
    time = np.arange(4000) * 0.01
    values = 30.0 * np.sin(0.5 * time) + RNG.normal(0.0, size, len(time))
    assert noise_of(values) == pytest.approx(size, rel=0.25)


def test_a_quantised_signal_is_no_surer_than_its_steps() -> None:
    values = np.round(np.linspace(0.0, 3.0, 900) / 0.25) * 0.25
    assert quantum_of(values) == pytest.approx(0.25)
    assert noise_of(values) == pytest.approx(0.25 / 12**0.5)


def test_too_short_a_signal_has_none() -> None:
    assert noise_of(np.array([1.0, np.nan, 2.0])) == 0.0


@given(st.floats(1e-9, 1e9))
def test_the_unit_of_a_signal_scales_its_steps_and_its_noise(factor: float) -> None:
    values = np.round(np.sin(np.arange(400) * 0.05) / 0.01) * 0.01
    assert quantum_of(factor * values) == pytest.approx(factor * quantum_of(values))
    assert noise_of(factor * values) == pytest.approx(factor * noise_of(values))
