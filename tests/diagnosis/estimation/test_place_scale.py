"""Magnitudes of places: the correlation time of signals and the rounding to half decades."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, strategies as st

from diagnosis.estimation.place_scale import correlation_time
from diagnosis.model.placed_effect import round_scale


def test_a_sine_is_decorrelated_after_a_sixth_of_its_period() -> None:
    """<(s(t+d) - s(t))^2> / 2 = (1 - cos(w d)) / 2 is half of the variance 1/2 at w d = pi / 3."""
    period = 0.01
    sine = np.sin(2.0 * np.pi * 0.5 * np.arange(4000) * period)
    assert correlation_time([sine], period) == pytest.approx(2.0 / 6.0, rel=0.15)


def test_noise_and_offset_do_not_change_the_time_much() -> None:
    rng, period = np.random.default_rng(1), 0.01
    sine = np.sin(2.0 * np.pi * 0.5 * np.arange(4000) * period)
    noisy = 1e3 + sine + rng.normal(0.0, 0.1, sine.shape)
    assert correlation_time([noisy], period) == pytest.approx(
        correlation_time([sine], period), rel=0.2
    )


def test_a_constant_signal_has_no_time() -> None:
    assert correlation_time([np.ones(100)], 0.01) == 0.0
    assert correlation_time([], 0.01) == 0.0


@given(st.floats(1e-9, 1e9))
def test_a_magnitude_is_rounded_to_half_decades(value: float) -> None:
    rounded = float(round_scale(value))
    assert 0.5 < value / rounded < 2.0
    assert round_scale(1000.0 * rounded) == 1000 * round_scale(rounded)
    decades = math.log10(rounded)
    assert min(abs(decades % 1.0), abs(decades % 1.0 - math.log10(3.0))) < 1e-9 or (
        abs(decades % 1.0 - 1.0) < 1e-9
    )


def test_half_decades_are_exact() -> None:
    assert round_scale(0.0029) == Fraction(3, 1000)
    assert round_scale(87.0) == 100
