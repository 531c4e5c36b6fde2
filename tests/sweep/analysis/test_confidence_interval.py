"""Intervals against published numbers and their coverage, also of numbers that are dependent."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from sweep.analysis.confidence_interval import (
    effective_sample_size,
    interval_of_mean,
    interval_of_quantile,
    interval_of_rate,
    wilson_interval,
)

ALONE = np.arange(1000)
"""Each number is a draw of its own."""


def test_the_wilson_interval_is_that_of_the_literature() -> None:
    """Newcombe, Statistics in Medicine 17 (1998), table I: 81/263, 15/148, 0/20, 1/29."""
    for hits, count, low, high in (
        (81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):  # fmt: skip
        assert wilson_interval(hits, count, 0.95) == pytest.approx((low, high), abs=5e-5)
        seen = np.array([1.0] * hits + [0.0] * (count - hits))
        assert interval_of_rate(seen, np.ones(count), 0.95) == pytest.approx((low, high), abs=5e-5)
    assert wilson_interval(0, 0, 0.95) is None
    assert interval_of_rate(np.zeros(0), np.zeros(0), 0.95) is None
    assert wilson_interval(7, 7, 0.95) == pytest.approx((1.0 - 0.3543, 1.0), abs=5e-5)


def test_the_mean_has_the_interval_of_student() -> None:
    values = np.array([1.0, 2.0, 4.0, 4.5, 9.0])
    truth = stats.t.interval(0.9, 4, values.mean(), values.std(ddof=1) / np.sqrt(5))
    assert interval_of_mean(values, ALONE[:5], 0.9) == pytest.approx(truth)
    assert interval_of_mean(values[:1], ALONE[:1], 0.9) is None


def test_a_median_is_between_its_order_statistics() -> None:
    """n = 10: the 2nd and the 9th hold the median with 97.85 % (David and Nagaraja)."""
    values = np.arange(1.0, 11.0)
    assert interval_of_quantile(values, ALONE[:10], 0.5, 0.95) == (2.0, 9.0)
    assert interval_of_quantile(values[:5], ALONE[:5], 0.5, 0.95) is None


def test_copies_of_a_number_make_nothing_surer() -> None:
    """As the replicates of a study without noise."""
    source = np.random.default_rng(1)
    values, draws = source.normal(size=40), np.arange(40)
    copies, of = np.repeat(values, 25), np.repeat(draws, 25)
    assert interval_of_mean(copies, of, 0.95) == pytest.approx(
        interval_of_mean(values, draws, 0.95)
    )
    middle, wide = (
        interval_of_quantile(values, draws, 0.5, 0.95),
        interval_of_quantile(copies, of, 0.5, 0.95),
    )
    assert middle and wide and wide[0] <= middle[0] < middle[1] <= wide[1]
    hits = (values > 0.3).astype(float)
    rate = interval_of_rate(hits, np.ones(40), 0.95)
    pooled = interval_of_rate(25 * hits, np.full(40, 25.0), 0.95)
    assert rate and pooled and pooled[0] <= rate[0] < rate[1] <= pooled[1]
    assert pooled[1] - pooled[0] == pytest.approx(rate[1] - rate[0], rel=0.05)


def test_the_effective_number_is_between_that_of_draws_and_of_numbers() -> None:
    each = np.full(200, 10.0)
    source = np.random.default_rng(2)
    independent = source.binomial(10, 0.3, 200).astype(float)
    equal = 10.0 * source.binomial(1, 0.3, 200).astype(np.float64)
    assert 1500 < effective_sample_size(independent, each, 0.95) <= 2000
    assert 190 < effective_sample_size(equal, each, 0.95) <= 200
    assert effective_sample_size(np.zeros(200), each, 0.95) == 200
    assert effective_sample_size(np.array([4.0]), np.array([10.0]), 0.95) == 0.0
    assert interval_of_rate(np.array([4.0]), np.array([10.0]), 0.95) is None


@pytest.mark.parametrize("draws", [10, 40])
def test_intervals_of_correlated_numbers_hold_as_often_as_they_say(draws: int) -> None:
    """20 numbers a draw, half of their variance that of the draw: as if independent, 60 % would."""
    source = np.random.default_rng(3)
    of = np.repeat(np.arange(draws), 20)
    held = np.zeros(3)
    runs = 400
    for _ in range(runs):
        values = source.normal(size=draws)[of] + source.normal(size=20 * draws)
        hits = np.bincount(of, values > 0.0).astype(np.float64)
        found = (
            interval_of_mean(values, of, 0.95), interval_of_quantile(values, of, 0.5, 0.95),
            interval_of_rate(hits, np.full(draws, 20.0), 0.95),
        )  # fmt: skip
        truths = (0.0, 0.0, 0.5)
        held += [e is None or e[0] <= t <= e[1] for e, t in zip(found, truths, strict=True)]
    assert (held / runs >= 0.92).all()
    assert held[0] / runs <= 0.98
