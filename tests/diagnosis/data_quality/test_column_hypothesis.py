"""Column hypotheses: recordings that are too short for the search are left out."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import pytest

from diagnosis.data.sampled_recording import decimate, sample_windows
from diagnosis.data_quality.column_hypothesis import find_clock_and_sign_errors
from diagnosis.data_quality.finding import Finding
from engine.recordings.recording import Recording, crop
from language.overlays.expand_document import Project
from tests.diagnosis.small_driveline import (
    delay_channel,
    document,
    driveline,
    read_recording_map,
    recording_of,
    scale_channel,
    spoil_recording,
    tip_in,
)

SHORT = crop(spoil_recording(), (Fraction(1), Fraction(1)))
"""A recording with one sample of each channel."""


def search(*recordings: Recording) -> list[Finding] | None:
    return find_clock_and_sign_errors(
        document(), Project(Path()), driveline(), read_recording_map(), recordings
    )


def test_without_a_recording_that_is_long_enough_there_is_no_search() -> None:
    with pytest.raises(ValueError, match="has one sample only"):
        sample_windows(SHORT, read_recording_map(), driveline(), ("w_em", "w_w"))
    assert search(SHORT) is None
    assert search() is None


def test_a_short_recording_does_not_prevent_the_search_in_another_one() -> None:
    wrong = spoil_recording(scale_channel("wheel", -1.0), "wrong")
    alone = search(wrong)
    assert alone and [one.kind for one in alone] == ["sign"]
    assert search(SHORT, wrong) == alone


def test_a_short_window_does_not_prevent_the_search_in_another_one() -> None:
    late = spoil_recording(delay_channel("wheel", 0.2), "late")
    whole, instant = (late.start, late.end), (Fraction(1), Fraction(1))
    alone = search(dataclasses.replace(late, windows=(whole,)))
    assert alone and [one.kind for one in alone] == ["clock_offset"]
    assert search(dataclasses.replace(late, windows=(instant, whole))) == alone


def test_a_recording_shorter_than_a_decimated_sample_is_left_out() -> None:
    times, values = tip_in()
    fast = recording_of("fast", times[:3] / 10.0, {key: v[:3] for key, v in values.items()})
    (series,) = sample_windows(fast, read_recording_map(), driveline(), ("w_em", "w_w"))
    with pytest.raises(ValueError, match="only 3 samples, 5 are averaged to one"):
        decimate(series)
    assert search(fast) == []
