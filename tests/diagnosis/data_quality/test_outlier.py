"""Values and stamps that leap, units and columns that are mistaken: told with their place."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from diagnosis.data_quality.finding import format_findings
from tests.diagnosis.recording_findings import check, finding_keys
from tests.diagnosis.rotor_project import run_command
from tests.diagnosis.small_driveline import (
    Spoil,
    Values,
    recording_of,
    scale_channel,
    spoil_recording,
    tip_in,
)

RPM = 30.0 / math.pi


def at(key: str, value: float) -> Spoil:
    """Spoil one sample in the middle."""

    def spoil(times: Values, values: dict[str, Values]) -> None:
        values[key][len(times) // 2] = value

    return spoil


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("key", ["torque", "motor"])
@pytest.mark.parametrize("value", [1e6, -1e6, 1e300, 1.7e308])
def test_one_value_far_from_all_others_is_told_with_its_place(key: str, value: float) -> None:
    found = check(spoil_recording(at(key, value)))
    assert finding_keys(found) == {("error", "outlier", key)}
    assert " at 4.5 s" in found.findings[0].text and f"{value:.4g} " in found.findings[0].text


@pytest.mark.filterwarnings("error")
def test_a_channel_of_huge_values_is_told_once() -> None:
    assert finding_keys(check(spoil_recording(scale_channel("motor", 1e160)))) == {
        ("error", "outlier", "motor")
    }


@pytest.mark.parametrize("seconds", [3600.0, 1.7e9])
@pytest.mark.parametrize("first", [450, 899])
def test_stamps_that_leap_are_told_and_not_simulated(seconds: float, first: int) -> None:
    times, values = tip_in()
    times = times.copy()
    times[first:] += seconds
    found = check(recording_of("leaping", times, values))
    assert finding_keys(found) == {("error", "leap", "")}
    assert f"time leaps from {(first - 1) / 100:g} s" in found.findings[0].text


def exchanged(times: Values, values: dict[str, Values]) -> None:
    values["motor"], values["wheel"] = values["wheel"], values["motor"]


@pytest.mark.parametrize(
    ("spoil", "kind", "channel", "text"),
    [
        (exchanged, "swap", "motor", "`motor` and `wheel` are exchanged"),
        (scale_channel("torque", 1e-3), "unit", "torque", "kN*m taken for N*m?"),
        (
            scale_channel("motor", 0.5 / math.pi),
            "unit",
            "motor",
            "revolutions per second taken for rad/s",
        ),
    ],
)
def test_what_is_tried_tells_units_and_columns_that_are_exchanged(
    spoil: Spoil, kind: str, channel: str, text: str
) -> None:
    one = check(spoil_recording(spoil, "bad"), spoil_recording(None, "good"))
    assert [(f.kind, f.recording, f.channel) for f in one.findings] == [(kind, "bad", channel)]
    assert text in one.findings[0].text
    (every,) = check(spoil_recording(spoil, "a"), spoil_recording(spoil, "b")).findings
    assert (every.kind, every.recording, every.channel) == (kind, "", channel)


def test_time_in_milliseconds_is_asked_for() -> None:
    times, values = tip_in()
    (one,) = [
        f for f in check(recording_of("slow", 1e3 * times, values)).findings if f.channel == ""
    ]
    assert (one.severity, one.kind) == ("error", "time")
    assert one.text.startswith("a sample each 10 s") and "is the time in ms?" in one.text


def test_what_is_missing_is_told_with_the_value_of_each_channel() -> None:
    def still(_: Values, values: dict[str, Values]) -> None:
        values["motor"], values["wheel"] = (
            0.0 * values["motor"] + 300.0,
            0.0 * values["wheel"] + 7.0,
        )

    lines = [text for _, text in format_findings(check(spoil_recording(still)).findings)]
    assert lines == [
        "`motor` (tip_in): is 300 all the time: the signal is missing",
        "`wheel` (tip_in): is 7 all the time: the signal is missing",
    ]


def test_a_recording_that_is_named_twice_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "run.csv").write_text("t_s,w_radps\n0,1\n1,2\n", "utf-8")
    assert run_command(tmp_path, "recording", "check", "run.csv", "./run.csv") == 2
    assert "named twice" in capsys.readouterr().err
