"""Dependence: what answers to known inputs, or is heard near rest, is no unknown input."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.unknown_input.dependence import input_dependence, standstill_dependence
from diagnosis.unknown_input.detection import (
    ENERGY_FRACTION,
    GAUSSIAN_FRACTION,
    GAUSSIAN_FRACTION_STD,
    is_intermittent,
)

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


@pytest.mark.parametrize(("part", "is_short"), [(0.05, True), (0.5, False)])
def test_an_input_that_acts_in_windows_is_small_most_of_the_time(
    part: float, is_short: bool
) -> None:
    rest, values = 0.05 * np.sin(TIME), []
    for start in (0.1, 0.3, 0.4):
        active = np.abs(TIME / TIME[-1] - start) < 0.5 * part
        values.append(np.where(active, 3.0, rest))
    assert is_intermittent(values, 100) is is_short


def test_the_part_of_a_normal_process_is_that_of_the_constants() -> None:
    rng = np.random.default_rng(3)
    parts = []
    for _ in range(400):
        falling = np.sort(rng.normal(size=400) ** 2)[::-1]
        parts.append(np.searchsorted(np.cumsum(falling), ENERGY_FRACTION * np.sum(falling)) / 400)
    assert np.mean(parts) == pytest.approx(GAUSSIAN_FRACTION, abs=0.005)
    assert np.std(parts) * 20.0 == pytest.approx(GAUSSIAN_FRACTION_STD, rel=0.1)


@pytest.mark.parametrize("memory", [1, 30, 100])
def test_a_hundredth_of_normal_processes_seem_to_act_in_windows(memory: int) -> None:
    rng = np.random.default_rng(memory)
    shape = np.exp(-np.arange(5 * memory) / memory)
    runs = (
        [np.convolve(rng.normal(size=1000 + 5 * memory), shape, "valid") for _ in range(3)]
        for _ in range(200)
    )
    assert sum(is_intermittent(some, 10 * memory) for some in runs) <= 4
