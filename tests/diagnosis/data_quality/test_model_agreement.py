"""Agreement of recordings with simulations, at any rate; the most excited part of a recording."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from diagnosis.data_quality.model_agreement import (
    compare_signals,
    most_excited_piece,
    recording_reference_time,
)
from diagnosis.data_quality.output_comparison import OutputComparison
from engine.recordings.recording import Channel, Recording
from tests.diagnosis.small_driveline import read_recording_map

FED = next(one for one in read_recording_map().columns.values() if one.to)
LENGTH = Fraction(4)


def recording(times: list[Fraction], values: list[float]) -> Recording:
    channel = Channel(FED, tuple(times), tuple(values))
    return Recording("run.csv", {FED.name: channel}, times[-1], times[0])


def test_the_part_with_the_largest_changes_is_taken() -> None:
    times = [Fraction(k, 10) for k in range(400)]
    values = [float(np.sin(k)) if 205 <= k < 235 else 0.0 for k in range(400)]
    found = most_excited_piece(recording(times, values), LENGTH)
    assert (found.start, found.end) == (Fraction(20), Fraction(24))


def test_a_leap_of_years_is_no_work() -> None:
    """There are 10^11 parts, but only some have samples."""
    times = [Fraction(k, 10) + (10**11 if k >= 50 else 0) for k in range(100)]
    values = [float(k % 2) if k >= 60 else 0.0 for k in range(100)]
    found = most_excited_piece(recording(times, values), LENGTH)
    assert found.start >= 10**11 + 4
    assert len(found.channels[FED.name].times) > 20
    far = recording([10**9 * one for one in times], values)
    assert most_excited_piece(far, LENGTH).start == 0


@pytest.mark.parametrize("period", [0.001, 0.5, 1.0, 20.0])
@pytest.mark.parametrize("late", [0, 40])
def test_signals_are_compared_in_the_time_of_the_recording(period: float, late: int) -> None:
    """A process that is sampled each minute has the lags of a minute."""
    rng = np.random.default_rng(5)
    moves = np.convolve(rng.normal(size=2200), np.hanning(100), "same")
    times = np.asarray(period * np.arange(2000), dtype=np.float64)
    measured = np.asarray(2.0 * moves[100 - late : 2100 - late], dtype=np.float64)
    compared = OutputComparison(times, measured, np.asarray(moves[100:2100], dtype=np.float64))
    found = compare_signals("run.csv", "T", compared)
    assert found is not None and found.is_clear
    assert found.gain == pytest.approx(2.0, rel=0.1)
    assert found.lag == pytest.approx(period * late, abs=3.0 * period)


@pytest.mark.parametrize("period", [Fraction(1, 10**9), Fraction(1, 10**300), Fraction(10**7)])
def test_the_reference_time_of_any_rate_is_positive(period: Fraction) -> None:
    times = [k * period for k in range(900)]
    time = recording_reference_time(recording(times, [float(k % 5) for k in range(900)]))
    assert 0 < time <= times[-1]
