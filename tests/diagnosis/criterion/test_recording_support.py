"""An effect is accepted where it gains enough, and more than that in one recording alone."""

from __future__ import annotations

import pytest

from diagnosis.criterion.likelihood_gain import LikelihoodGain
from diagnosis.criterion.recording_support import (
    OPPOSED_FACTOR,
    SINGLE_RECORDING_FACTOR,
    discount_unsupported,
    supported_gain,
)
from diagnosis.criterion.threshold import DEFAULT_THRESHOLD


@pytest.mark.parametrize(
    ("train", "each", "wanted"),
    [
        (200.0, (60.0, 50.0, 90.0), True),
        (740.0, (-27.0, 19.0, 957.0), False),
        (760.0, (-27.0, 19.0, 957.0), True),
        (713.0, (801.0, 3.0, -10.0, -13.0, -7.0, -7.0, -2.0, -22.0, -7.0), False),
        (300.0, (20.0, 25.0, 15.0), False),
        (60.0, (60.0, 50.0, 90.0), False),
        (90.0, (300.0,), True),
    ],
)
def test_what_gains_in_one_recording_alone_has_to_gain_ten_times_as_much(
    train: float, each: tuple[float, ...], wanted: bool
) -> None:
    assert (supported_gain(LikelihoodGain(train, sum(each), each)) > DEFAULT_THRESHOLD) == wanted


@pytest.mark.parametrize(
    ("train", "each", "wanted"),
    [
        (1311.0, (-900.0, 115.0, 117.0, 225.0, 110.0, 110.0), True),
        (1311.0, (-900.0, 15.0, 17.0, 25.0, 10.0, 10.0), False),
        (200.0, (-900.0, 115.0, 117.0, 225.0, 110.0, 110.0), False),
        (1311.0, (-900.0, 400.0), False),
        (411.0, (-48.0, 7.0, 5.0, -11.0, 30.0, 15.0, 49.0, -18.0, 372.0), False),
    ],
)
def test_one_recording_alone_does_not_deny_what_all_others_show_clearly(
    train: float, each: tuple[float, ...], wanted: bool
) -> None:
    assert (supported_gain(LikelihoodGain(train, sum(each), each)) > DEFAULT_THRESHOLD) == wanted


def test_of_two_recordings_none_is_against_all() -> None:
    each = (300.0, 5.0)
    assert supported_gain(LikelihoodGain(300.0, sum(each), each)) == 300.0 / OPPOSED_FACTOR
    assert (
        supported_gain(LikelihoodGain(300.0, sum(each), each), single_recording_factor=2.0)
        == 300.0 / 2.0
    )


def test_a_loss_is_not_made_less() -> None:
    assert discount_unsupported(-20.0, (40.0, -30.0, -30.0)) == -20.0
    assert discount_unsupported(20.0, (40.0, -10.0, -10.0)) == 20.0 / SINGLE_RECORDING_FACTOR


def test_an_unstable_model_counts_as_nothing() -> None:
    lost = -float("inf")
    assert supported_gain(LikelihoodGain(lost, lost, (lost, lost, lost))) == lost
