"""Assumptions: what a recording leaves out or assumes is told once by the commands."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from modewright.cli.app import app
from modewright.cli.common.console import console
from modewright.cli.common.exit_codes import run_with_exit_code

SPEC = """\
language: 1
automaton: selector
period: 10 ms
numbers: float64
inputs: {u: {unit: N*m, range: [-1000, 1000]}}
initial: low
modes:
  low: {transitions: {high: {when: u > 10 N*m}}}
  high: {transitions: {low: {when: u < 5 N*m}}}
outputs: [mode]
"""
MAP = "language: 1\nmap: bench\ndbc: ../car.dbc\ncolumns: {T_em: {to: u, unit: N*m}}\n"
DBC = """\
VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Motor: 2 ECU
 SG_ T_em : 0|16@1- (0.25,0) [0|0] "Nm" ECU
"""
SHORT = "the one at 1.2 s has 1 bytes, the DBC says 2"
CUT = "line 22 is no complete frame: `(1.210000) ca`"


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    console.cache_clear()
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "selector.yaml").write_text(SPEC, "utf-8")
    (tmp_path / "spec" / "bench.yaml").write_text(MAP, "utf-8")
    (tmp_path / "car.dbc").write_text(DBC, "utf-8")
    values = [f"{8 * k:02X}00" for k in range(20)]
    rows = [f"({1.0 + 0.01 * k:.6f}) can0 100#{data}" for k, data in enumerate(values)]
    rows += ["(1.200000) can0 100#08", "(1.210000) ca"]
    (tmp_path / "drive.log").write_text("\n".join(rows), "utf-8")
    return tmp_path


def run(*arguments: str) -> int:
    return run_with_exit_code(partial(app, [*arguments], standalone_mode=False))


def test_the_check_of_a_recording_tells_each_note_once(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("recording", "check", "drive.log", "--map", "bench", "--json")
    found = json.loads(capsys.readouterr().out)["assumptions"]
    assert [(item["recording"], item["reason"]) for item in found] == [
        ("drive.log", CUT),
        ("drive.log", SHORT),
    ]


def test_a_replay_tells_the_notes(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("replay", "selector", "drive.log", "--map", "bench") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert text.count(SHORT) == text.count(CUT) == 1
    assert run("replay", "selector", "drive.log", "--map", "bench", "--json") == 0
    found = json.loads(capsys.readouterr().out)["assumptions"]
    assert [item["reason"] for item in found] == [CUT, SHORT]


def test_an_unknown_unit_is_assumed_without_a_map_and_told(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "car.dbc").write_text(DBC.replace('"Nm"', '"Furlong"'), "utf-8")
    run("recording", "check", "drive.log", "--dbc", "car.dbc", "--json")
    findings = json.loads(capsys.readouterr().out)["findings"]
    texts = [f["text"] for f in findings if f["kind"] == "unit" and f["channel"] == "T_em"]
    assert texts == ["has the unit `Furlong`, which is not understood: taken without a unit"]


def test_a_group_without_time_does_not_hide_the_others(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from asammdf import MDF, Signal

    stamps = np.arange(200) * 0.01
    with MDF(version="4.10") as mdf:
        mdf.append([Signal(np.sin(stamps), stamps, name="T_em", unit="Nm")])
        mdf.append([Signal(stamps, stamps, name="row")])
        master = mdf.groups[1].channels[0]
        master.channel_type = 0
        master.name = "stamp"
        mdf.save(project / "drive.mf4", overwrite=True)
    run("recording", "check", "drive.mf4", "--json")
    found = json.loads(capsys.readouterr().out)
    assert [channel["name"] for channel in found["channels"]] == ["T_em"]
    texts = {f["channel"]: f["text"] for f in found["findings"] if f["kind"] == "left_out"}
    assert "cannot be read (channel row has no time" in texts["row"]


def test_words_of_a_dbc_are_names_of_an_enumeration(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = SPEC.replace(
        "inputs: {u: {unit: N*m, range: [-1000, 1000]}}",
        "inputs: {u: {type: enum, values: [idle, busy]}}",
    )
    spec = spec.replace("u > 10 N*m", "u == busy").replace("u < 5 N*m", "u == idle")
    (project / "spec" / "selector.yaml").write_text(spec, "utf-8")
    (project / "spec" / "bench.yaml").write_text(MAP.replace(", unit: N*m", ""), "utf-8")
    dbc = DBC.replace('(0.25,0) [0|0] "Nm"', '(1,0) [0|0] ""')
    (project / "car.dbc").write_text(dbc + '\nVAL_ 256 T_em 5 "Busy" 9 "idle" ;\n', "utf-8")
    rows = [f"({1.0 + 0.01 * k:.6f}) can0 100#{'05' if k > 3 else '09'}00" for k in range(10)]
    (project / "drive.log").write_text("\n".join(rows) + "\n", "utf-8")
    assert run("replay", "selector", "drive.log", "--map", "bench", "--json") == 0
    events = json.loads(capsys.readouterr().out)["events"]
    assert [event["target"] for event in events] == ["high"]


SCENARIO = """\
language: 1
scenario: driven
of: selector
horizon: recording
recording: {file: drive.log, map: bench}
"""


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", "selector", "-s", "driven"),
        ("lockstep", "selector", "-s", "driven"),
        ("compare", "selector:driven", "selector:driven"),
    ],
)
def test_every_run_on_a_recording_tells_the_notes(
    project: Path, command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "spec" / "driven.yaml").write_text(SCENARIO, "utf-8")
    assert run(*command) == 0
    text = " ".join(capsys.readouterr().err.split())
    assert f"({SHORT})" in text and f"({CUT})" in text
    assert "assumed of the recording: frames of message `Motor`" in text
