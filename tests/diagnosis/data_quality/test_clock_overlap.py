"""Clocks of one recording that share no time: told with both columns, and nothing is simulated."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from diagnosis.data_quality.clock_overlap import find_clock_mismatches
from diagnosis.data_quality.model_agreement import compare_signals
from diagnosis.data_quality.output_comparison import OutputComparison
from engine.recordings.recording import Recording
from tests.diagnosis.recording_findings import check, finding_keys
from tests.diagnosis.rotor_project import run_command
from tests.diagnosis.small_driveline import MAP, SPEC, spoil_recording, tip_in


def with_clock(factor: int, offset: int = 0) -> Recording:
    """Return a good recording whose wheel has a clock of its own, which is wrong."""
    good = spoil_recording()
    channels = {name: dataclasses.replace(one, clock="t_s") for name, one in good.channels.items()}
    times = tuple(factor * time + offset for time in channels["wheel"].times)
    channels["wheel"] = dataclasses.replace(channels["wheel"], times=times, clock="t_wheel_s")
    return dataclasses.replace(good, channels=channels)


@pytest.mark.parametrize(
    ("factor", "offset", "amount"),
    [(1000, 1, "only 7.99 s"), (1000, 0, "only 8.99 s"), (1, 9, "no time"), (1, 10**9, "no time")],
)
def test_clocks_that_share_no_time_are_told_with_both_columns(
    factor: int, offset: int, amount: str
) -> None:
    found = check(with_clock(factor, offset))
    assert finding_keys(found) == {("error", "time", "wheel")}
    (one,) = found.findings
    assert "`torque` (time `t_s`, 0 s to 8.99 s) and `wheel` (time `t_wheel_s`, " in one.text
    assert f" have {amount} in common" in one.text


def test_clocks_that_overlap_are_left_in_peace() -> None:
    assert not find_clock_mismatches(with_clock(1))
    assert not find_clock_mismatches(with_clock(1, 8))
    assert not find_clock_mismatches(with_clock(50))


def test_a_held_input_may_have_its_only_sample_before_all_others() -> None:
    good = spoil_recording()
    single = dataclasses.replace(good.channels["brake"], times=(Fraction(-1),), values=(0.0,))
    one = dataclasses.replace(good, channels={**good.channels, "brake": single})
    assert not find_clock_mismatches(one)


@pytest.mark.parametrize("count", [0, 1])
def test_signals_without_samples_in_common_are_not_compared(count: int) -> None:
    nothing = np.zeros(count)
    assert compare_signals("run", "y", OutputComparison(nothing, nothing, nothing)) is None


def test_a_diagnosis_that_is_wanted_anyway_is_refused_at_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "small.yaml").write_text(SPEC, "utf-8")
    own = MAP.replace("w_w, unit: rad/s", "w_w, unit: rad/s, time: t_wheel_s")
    (tmp_path / "spec" / "bench.yaml").write_text(own, "utf-8")
    times, values = tip_in()
    names = ["torque", "brake", "motor", "wheel"]
    rows = [
        f"{1000 * t:.9g},{t:.9g}," + ",".join(f"{values[n][k]:.9g}" for n in names)
        for k, t in enumerate(times)
    ]
    head = "t_s,t_wheel_s," + ",".join(names)
    (tmp_path / "ms.csv").write_text("\n".join([head, *rows]) + "\n", "utf-8")
    command = ["diagnose", "small_driveline", "--train", "ms.csv", "--map", "bench"]
    assert run_command(tmp_path, *command, "--out", "found", "--anyway") == 1
    told = capsys.readouterr().err
    assert "ms.csv:1:1: error: `torque` (time `t_s`, 0 s to 8990 s) and `wheel` (time" in told
