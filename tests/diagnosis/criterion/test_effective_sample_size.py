"""Effective sample size: white innovations count one by one, those with a memory less."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.signal import lfilter

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording

BLANK = SampledRecording("a", Fraction(1, 100), Fraction(0), np.zeros((625, 1)), np.zeros((625, 1)))


def autocorrelation_of(*innovations: Reals) -> float:
    """The integrated autocorrelation of innovations (samples, outputs) of recordings."""
    model = SimpleNamespace(prediction=SimpleNamespace(innovations=innovations))
    return integrated_autocorrelation(cast(Any, model), [BLANK])


def noise(outputs: int = 1, seed: int = 1) -> Reals:
    return np.random.default_rng(seed).normal(size=(20_000, outputs))


def test_white_innovations_count_one_by_one() -> None:
    assert autocorrelation_of(noise(), noise(seed=2)) == pytest.approx(1.0, abs=0.01)


def test_correlated_ones_count_by_the_squares_of_their_correlations() -> None:
    """x(k) = a x(k-1) + e(k) has 1 + 2 a^2 / (1 - a^2)."""
    a = 0.8
    x = lfilter([1.0], [1.0, -a], noise(), axis=0)
    expected = (1.0 + a**2) / (1.0 - a**2)
    assert autocorrelation_of(x) == pytest.approx(expected, rel=0.05)
    assert autocorrelation_of(50.0 * x) == pytest.approx(autocorrelation_of(x))
    both = np.column_stack([x, noise()])
    assert autocorrelation_of(both) == pytest.approx((expected + 1.0) / 2.0, rel=0.05)


def test_unknown_and_vanishing_innovations_do_not_count() -> None:
    gaps = noise()
    gaps[::7] = np.nan
    assert autocorrelation_of(gaps) == pytest.approx(1.0, abs=0.01)
    assert autocorrelation_of(np.zeros((100, 1))) == 1.0
