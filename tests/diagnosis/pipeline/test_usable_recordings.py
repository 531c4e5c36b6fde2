"""What no model can follow is left out, even where all recordings are wanted anyway."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from diagnosis.data_quality.channel import MIN_SAMPLES
from diagnosis.pipeline.usable_recordings import (
    MAX_SAMPLES,
    MAX_VALUE,
    LazyRecordings,
    unusable_reason,
)
from engine.recordings.recording import Channel, Recording
from language.model.system import ColumnMapping
from tests.diagnosis.small_driveline import read_recording_map

COLUMNS = read_recording_map().columns
COMPARED = next(one for one in COLUMNS.values() if one.compare)
YEARS = Fraction(10**9)
"""A time stamp [s] behind a leap."""
FED = next(one for one in COLUMNS.values() if not one.compare)


def recording(times: list[Fraction], values: list[float] | None = None) -> Recording:
    numbers = tuple(values if values is not None else np.sin(np.arange(len(times))).tolist())
    channel = Channel(COMPARED, tuple(times), numbers)
    return Recording("run.csv", {COMPARED.name: channel}, times[-1], times[0])


def every(period: Fraction, count: int = 100) -> list[Fraction]:
    return [k * period for k in range(count)]


def test_a_usual_recording_is_workable() -> None:
    assert unusable_reason(recording(every(Fraction(1, 100)))) == ""


def test_few_samples_are_not() -> None:
    assert unusable_reason(recording(every(Fraction(1, 100), MIN_SAMPLES))) == ""
    assert "9 of the 10 samples that are needed" in unusable_reason(
        recording(every(Fraction(1, 100), MIN_SAMPLES - 1))
    )


def test_nanoseconds_are_not() -> None:
    assert "in another unit" in unusable_reason(recording(every(Fraction(1, 10**9))))


def test_a_leap_of_years_is_not() -> None:
    times = every(Fraction(1, 100))
    assert unusable_reason(recording([*times, times[-1] + Fraction(MAX_SAMPLES, 100) - 2])) == ""
    assert "FILE@0..60" in unusable_reason(recording([*times, YEARS]))


@pytest.mark.parametrize("column", [COMPARED, FED])
def test_values_at_which_a_run_is_given_up_are_not(column: ColumnMapping) -> None:
    usual = recording(every(Fraction(1, 100)))
    channel = dataclasses.replace(usual.channels[COMPARED.name], column=column)
    for value, is_fine in ((MAX_VALUE, True), (-2 * MAX_VALUE, False)):
        one = dataclasses.replace(channel, values=(value, *channel.values[1:]))
        found = unusable_reason(dataclasses.replace(usual, channels={"x": one}))
        assert (found == "") is is_fine


def test_a_single_sample_of_an_input_is_enough() -> None:
    usual = recording(every(Fraction(1, 100)))
    fed = Channel(FED, (Fraction(0),), (1.0,))
    assert unusable_reason(dataclasses.replace(usual, channels={**usual.channels, "u": fed})) == ""


def test_wanted_anyway_nothing_is_concluded_from_it(tmp_path: Path) -> None:
    rows = [f"{k / 100},{(-1) ** k}e300,0,1,0" for k in range(200)]
    file = tmp_path / "alternating.csv"
    file.write_text("\n".join(["t_s,T_em_Nm,T_br_Nm,w_em_radps,w_w_radps", *rows]))
    found = mw.diagnose("blind_driveline", [file], anyway=True, thresholds="usual")
    assert found.diagnosis is None and found.verdict.verdict == "unknown"
    assert any("values up to 1e+300 in SI, beyond 1e+12" in one for one in found.verdict.messages)


def test_what_is_held_out_is_read_when_it_is_asked_for_and_refused_then() -> None:
    usual, leaps = recording(every(Fraction(1, 100))), recording([*every(Fraction(1, 100)), YEARS])
    files = {Path("train.csv"): usual, Path("late.csv"): usual, Path("leaps.csv"): leaps}
    asked: list[Path] = []

    def read(path: Path) -> Recording:
        asked.append(path)
        return files[path]

    train, late, leaping = files
    known = LazyRecordings({train: usual}, (late, leaping), read)
    assert known[train] is usual and list(known) == [train] and asked == []
    assert known.get(late) is usual and known.get(late) is usual and asked == [late]
    with pytest.raises(ValueError, match="uses a part of it"):
        known.get(leaping)
    assert known.get(Path("another.csv")) is None
