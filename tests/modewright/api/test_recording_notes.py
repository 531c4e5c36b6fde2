"""Notes of readers: what a recording leaves out or assumes is told once by the commands."""

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
SHORT = "left out: 1 of 21 frames of message `Motor`; the one at 1.2 s has 1 bytes"


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
    findings = json.loads(capsys.readouterr().out)["findings"]
    notes = [(f["channel"], f["text"]) for f in findings if f["kind"] == "reading"]
    assert [channel for channel, _ in notes] == ["", "T_em"]
    assert notes[0][1] == "left out: line 22; it is no complete frame: `(1.210000) ca`"
    assert notes[1][1].startswith(SHORT)
    assert {f["severity"] for f in findings if f["kind"] == "reading"} == {"note"}


def test_a_replay_tells_the_notes(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("replay", "selector", "drive.log", "--map", "bench") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert text.count(f"note: T_em: {SHORT}") == 1
    assert "note: left out: line 22; it is no complete frame" in text
    assert run("replay", "selector", "drive.log", "--map", "bench", "--json") == 0
    notes = json.loads(capsys.readouterr().out)["notes"]
    assert [note["channel"] for note in notes] == ["", "T_em"]


def test_an_unknown_unit_is_assumed_without_a_map_and_told(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "car.dbc").write_text(DBC.replace('"Nm"', '"Furlong"'), "utf-8")
    run("recording", "check", "drive.log", "--dbc", "car.dbc", "--json")
    findings = json.loads(capsys.readouterr().out)["findings"]
    texts = [f["text"] for f in findings if f["kind"] == "reading" and f["channel"] == "T_em"]
    assert "has the unknown unit 'Furlong': the unit 1 is assumed" in texts


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
