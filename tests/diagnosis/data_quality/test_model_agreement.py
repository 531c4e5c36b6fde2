"""The most excited part of a recording is found, also in one whose time leaps by years."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from diagnosis.data_quality.model_agreement import most_excited_piece
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
    assert (float(found.start), float(found.end)) == (20.0, 24.0)


def test_a_leap_of_years_is_no_work() -> None:
    """There are 10^11 parts, but only some have samples."""
    times = [Fraction(k, 10) + (10**11 if k >= 50 else 0) for k in range(100)]
    values = [float(k % 2) if k >= 60 else 0.0 for k in range(100)]
    found = most_excited_piece(recording(times, values), LENGTH)
    assert found.start >= 10**11 + 4
    assert len(found.channels[FED.name].times) > 20
    far = recording([10**9 * one for one in times], values)
    assert most_excited_piece(far, LENGTH).start == 0
