"""Dependence: what answers to known inputs, or is heard near rest, is no unknown input."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.unknown_input.dependence import input_dependence, standstill_dependence
from diagnosis.unknown_input.detection import MAX_ACTIVE_FRACTION, is_intermittent

TIME = np.arange(0.0, 10.0, 0.01)


def recording(column: Reals) -> SampledRecording:
    return SampledRecording("a", Fraction(1, 100), Fraction(0), column[:, None], column[:, None])


def test_what_comes_when_inputs_move_answers_to_them() -> None:
    series = recording(np.where((TIME > 3.0) & (TIME < 6.0), 100.0, 0.0))
    answer = np.exp(-np.abs(TIME - 3.05) / 0.1) - np.exp(-np.abs(TIME - 6.05) / 0.1)
    other = np.exp(-np.abs(TIME - 1.5) / 0.1) + np.exp(-np.abs(TIME - 8.0) / 0.1)
    start = burn_in_samples(series)
    assert input_dependence([series], [answer[start:]]) > 0.8
    assert input_dependence([series], [other[start:]]) < 0.1
    assert input_dependence([series], [0.0 * answer[start:]]) == 0.0


def test_what_is_heard_near_rest_is_what_a_friction_lacks() -> None:
    speed = 50.0 * np.cos(0.3 * np.pi * TIME)
    series = recording(speed)
    start = burn_in_samples(series)
    rubs = np.exp(-((speed / 4.0) ** 2)) * np.sign(np.gradient(speed))
    hit = np.exp(-np.abs(TIME - 3.3) / 0.1)
    assert standstill_dependence([series], [rubs[start:]]) > 0.9
    assert standstill_dependence([series], [hit[start:]]) < 0.3


@pytest.mark.parametrize(("part", "is_short"), [(0.5, True), (2.0, False)])
def test_an_input_that_acts_in_windows_is_small_most_of_the_time(
    part: float, is_short: bool
) -> None:
    rest = 0.05 * np.sin(TIME)
    active = np.arange(len(TIME)) < part * MAX_ACTIVE_FRACTION * len(TIME)
    acts = np.where(active, 3.0, rest)
    assert is_intermittent([acts, acts]) is is_short
