"""Explained share: energies and shares of hand-made numbers, and what a share is worth."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad

from diagnosis.criterion.explained_share import (
    FORM_ERROR,
    FORM_SAMPLES,
    LEAST_FORM_ERROR,
    MAX_ORDINARY_ENERGY,
    MIN_SHARE,
    explained_share,
    is_ordinary,
    least_variances,
    log_form_weight,
    remaining_energy,
)
from diagnosis.estimation.estimate import Estimate

LARGE = 1e9
"""An energy beside which noise does not count."""
gains = st.floats(0.0, 1e6)
parts = st.floats(0.0, 4.0)
variances = st.lists(st.floats(1e-6, 1e6), min_size=2, max_size=2)


def model(variances: list[float], cost: float = 0.0) -> Estimate:
    """A fit with these mean-square innovations."""
    prediction = SimpleNamespace(variances=np.array(variances))
    return cast(Estimate, cast(Any, SimpleNamespace(cost=cost, prediction=prediction)))


DIVERGED = model([1e-9, 1e-9], math.inf)


def test_the_floor_is_the_least_of_each_channel_without_diverged_models() -> None:
    floor = least_variances([model([4.0, 1.0]), model([2.0, 3.0]), DIVERGED])
    assert floor.tolist() == [2.0, 1.0]


def test_the_energy_is_what_is_left_above_the_floor_in_its_units() -> None:
    floor = np.array([2.0, 1.0])
    assert remaining_energy(model([4.0, 1.5]), floor) == 1.5
    assert remaining_energy(model([2.0, 1.0]), floor) == 0.0
    assert remaining_energy(DIVERGED, floor) == math.inf


def test_the_share_is_the_part_of_the_energy_of_the_base_that_goes() -> None:
    floor, base = np.array([2.0, 1.0]), model([8.0, 2.0])
    assert explained_share(base, base, floor) == 0.0
    assert explained_share(model([2.0, 1.0]), base, floor) == 1.0
    assert explained_share(model([4.0, 1.0]), base, floor) == 0.75
    assert explained_share(model([8.0, 6.0]), base, floor) == -1.0
    assert explained_share(DIVERGED, base, floor) == -math.inf


def test_of_a_base_that_leaves_nothing_no_share_is_explained() -> None:
    floor = np.array([2.0, 1.0])
    assert explained_share(model([2.0, 1.0]), model([2.0, 1.0]), floor) == 0.0


def test_an_energy_up_to_that_of_the_floor_is_ordinary() -> None:
    assert is_ordinary(2.0 * MAX_ORDINARY_ENERGY, 2)
    assert not is_ordinary(2.0 * MAX_ORDINARY_ENERGY + 1e-9, 2)


@given(variances, variances)
def test_shares_do_not_depend_on_units_and_are_at_most_1(
    first: list[float], second: list[float]
) -> None:
    base, other = model(first), model(second)
    floor = least_variances([base, other])
    share = explained_share(other, base, floor)
    assert share <= 1.0
    units = np.array([1e-3, 50.0])
    scaled = [model((units * one.prediction.variances).tolist()) for one in (other, base)]
    again = explained_share(scaled[0], scaled[1], least_variances(scaled))
    assert again == pytest.approx(share, rel=1e-6, abs=1e-6)


def test_the_least_share_follows_from_the_error_of_the_form() -> None:
    """The mass of an effect, integrated over the logarithm of the error."""
    low, high = math.log(LEAST_FORM_ERROR), math.log(FORM_ERROR)

    def density(log_error: float) -> float:
        variance = math.exp(2.0 * log_error)
        misfit = 2.0 * log_error + (1.0 - MIN_SHARE) / variance
        return math.exp(-FORM_SAMPLES / 2.0 * misfit) / (high - low)

    mass, _ = quad(density, low, high)
    assert mass == pytest.approx(math.exp(-FORM_SAMPLES / 2.0), rel=0.03)
    assert pytest.approx(0.69, abs=0.01) == MIN_SHARE


def test_an_effect_that_leaves_nothing_is_more_probable_than_an_unknown_disturbance() -> None:
    assert log_form_weight(0.0, LARGE) > log_form_weight(None, LARGE) + 5.0
    assert log_form_weight(1.0, LARGE) < log_form_weight(None, LARGE) - 5.0


def test_at_the_least_share_an_effect_and_an_unknown_disturbance_weigh_the_same() -> None:
    assert log_form_weight(1.0 - MIN_SHARE, LARGE, 1) == pytest.approx(log_form_weight(None, LARGE))
    for more, is_better in ((0.01, False), (-0.01, True)):
        weight = log_form_weight(1.0 - MIN_SHARE + more, LARGE, 1)
        assert (weight > log_form_weight(None, LARGE)) is is_better


def test_a_tiny_gain_separates_nothing() -> None:
    weights = [log_form_weight(part, 0.0, 1) for part in (0.0, 0.5, 1.0)]
    assert max(weights) - min(weights) < 1.0
    assert abs(max(weights) - log_form_weight(None, 0.0)) < 1.0


@given(parts, gains, st.integers(0, 9))
def test_each_parameter_has_the_same_price(part: float, gain: float, count: int) -> None:
    price = log_form_weight(part, gain) - log_form_weight(part, gain, count)
    assert price == pytest.approx(count / 2.0 * math.log(FORM_SAMPLES))


@given(parts, parts, gains)
def test_an_effect_that_leaves_less_weighs_more(first: float, second: float, gain: float) -> None:
    low, high = sorted((first, second))
    assert log_form_weight(low, gain) >= log_form_weight(high, gain)


@given(gains, gains)
def test_a_larger_gain_separates_more(first: float, second: float) -> None:
    low, high = sorted((first, second))

    def distance(gain: float) -> float:
        return log_form_weight(0.0, gain) - log_form_weight(1.0, gain)

    assert 0.0 < distance(low) <= distance(high) + 1e-9
    ratio = math.log(FORM_ERROR / LEAST_FORM_ERROR)
    most = FORM_SAMPLES * (ratio + 0.5 / FORM_ERROR**2) + 5.0
    assert distance(high) <= most


@given(st.floats(-4.0, 0.0), gains)
def test_more_than_everything_cannot_be_explained(part: float, gain: float) -> None:
    assert log_form_weight(part, gain) == log_form_weight(0.0, gain)
