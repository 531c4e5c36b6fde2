"""Rates, intervals and calibration against scipy and values worked out by hand."""

from __future__ import annotations

import pytest
from scipy.stats import binomtest

from tests.validation.study.proportion import Rate, calibration_error, reliability


@pytest.mark.parametrize(("hits", "count"), [(0, 5), (5, 5), (1, 3), (96, 100), (297, 312)])
def test_the_interval_is_that_of_wilson(hits: int, count: int) -> None:
    known = binomtest(hits, count).proportion_ci(0.95, method="wilson")
    assert Rate(hits, count).interval() == pytest.approx((known.low, known.high), abs=1e-12)


def test_nothing_has_no_rate() -> None:
    assert Rate(0, 0).share == 0.0
    assert Rate(0, 0).interval() == (0.0, 1.0)


def test_calibration_by_hand() -> None:
    said = [(0.95, True), (0.95, True), (0.95, False), (0.55, True), (1.0, True)]
    bins = reliability(said)
    assert [one.right.count for one in bins] == [1, 4]
    # 0.55 was right always; the four with a mean of 0.9625 were right three times
    assert calibration_error(said) == pytest.approx((0.45 + 4 * (0.9625 - 0.75)) / 5)
    assert calibration_error([]) == 0.0
