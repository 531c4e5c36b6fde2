"""Intervals against published numbers and against their coverage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from sweep.interval import of_mean, of_quantile, wilson


def test_the_wilson_interval_is_that_of_the_literature() -> None:
    """Newcombe, Statistics in Medicine 17 (1998), table I: 81/263, 15/148, 0/20, 1/29."""
    for hits, count, low, high in (
        (81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):  # fmt: skip
        assert wilson(hits, count, 0.95) == pytest.approx((low, high), abs=5e-5)
    assert wilson(0, 0, 0.95) is None
    assert wilson(7, 7, 0.95) == pytest.approx((1.0 - 0.3543, 1.0), abs=5e-5)


def test_the_mean_has_the_interval_of_student() -> None:
    values = np.array([1.0, 2.0, 4.0, 4.5, 9.0])
    truth = stats.t.interval(0.9, 4, values.mean(), values.std(ddof=1) / np.sqrt(5))
    assert of_mean(values, 0.9) == pytest.approx(truth)
    assert of_mean(values[:1], 0.9) is None


def test_a_median_is_between_its_order_statistics() -> None:
    """n = 10: the 2nd and the 9th hold the median with 97.85 % (David and Nagaraja)."""
    values = [float(k) for k in range(1, 11)]
    assert of_quantile(values, 0.5, 0.95) == (2.0, 9.0)
    assert of_quantile(values[:5], 0.5, 0.95) is None
