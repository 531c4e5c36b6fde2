"""An effect is accepted where it gains enough, and more than that in one recording alone."""

from __future__ import annotations

import pytest

from diagnosis.evidence import Evidence
from diagnosis.selection import counted
from diagnosis.threshold import USUAL


@pytest.mark.parametrize(
    ("train", "each", "wanted"),
    [
        (200.0, (60.0, 50.0, 90.0), True),
        (220.0, (-27.0, 19.0, 957.0), False),
        (230.0, (-27.0, 19.0, 957.0), True),
        (300.0, (20.0, 25.0, 15.0), False),
        (60.0, (60.0, 50.0, 90.0), False),
        (90.0, (300.0,), True),
    ],
)
def test_what_gains_in_one_recording_alone_has_to_gain_three_times_as_much(
    train: float, each: tuple[float, ...], wanted: bool
) -> None:
    assert (counted(Evidence(train, sum(each), each)) > USUAL) == wanted


@pytest.mark.parametrize(
    ("train", "each", "wanted"),
    [
        (1311.0, (-900.0, 115.0, 117.0, 225.0, 110.0, 110.0), True),
        (1311.0, (-900.0, 15.0, 17.0, 25.0, 10.0, 10.0), False),
        (200.0, (-900.0, 115.0, 117.0, 225.0, 110.0, 110.0), False),
        (1311.0, (-900.0, 400.0), False),
    ],
)
def test_one_recording_alone_does_not_deny_what_all_others_show_clearly(
    train: float, each: tuple[float, ...], wanted: bool
) -> None:
    assert (counted(Evidence(train, sum(each), each)) > USUAL) == wanted


def test_an_unstable_model_counts_as_nothing() -> None:
    lost = -float("inf")
    assert counted(Evidence(lost, lost, (lost, lost, lost))) == lost


def test_the_rest_is_what_the_best_recording_leaves() -> None:
    assert Evidence(1.0, 60.0, (10.0, 40.0, 10.0)).without_best == 20.0
