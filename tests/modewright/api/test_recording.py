"""Recording: the command that looks at recordings, its table, JSON, picture and exit codes."""

from __future__ import annotations

import json
import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from modewright.cli.app import app
from modewright.cli.common.console import console
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.diagnosis.small_driveline import MAP, SPEC, Values, tip_in


def write(path: Path, spoil: float = 1.0) -> Path:
    times, values = tip_in()
    columns = {"t_s": times, **values, "motor": values["motor"] * spoil}
    return table(path, columns)


def table(path: Path, columns: dict[str, Values]) -> Path:
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(f"{v:.9g}" for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    console.cache_clear()
    (tmp_path / "spec").mkdir()
    named = SPEC.replace("step: 5 ms", "step: 5 ms\nrecording_map: bench")
    (tmp_path / "spec" / "small.yaml").write_text(named, "utf-8")
    (tmp_path / "spec" / "bench.yaml").write_text(MAP, "utf-8")
    write(tmp_path / "drive.csv")
    write(tmp_path / "spoiled.csv", 60 / (2 * np.pi))
    return tmp_path


def run(*arguments: str) -> int:
    return run_with_exit_code(
        partial(app, ["recording", "check", *arguments], standalone_mode=False)
    )


def test_a_good_recording_with_the_map_of_the_spec(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("drive.csv", "--spec", "small_driveline", "--plot", "drive.png") == 0
    text = capsys.readouterr().out
    assert "drive.csv  torque   T_em" in text and "100 Hz" in text
    assert "nothing odd was found in these data" in text
    assert (project / "drive.png").read_bytes().startswith(b"\x89PNG")


def test_a_wrong_unit_is_an_exit_code_and_a_line(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("spoiled.csv", "--spec", "small_driveline") == 1
    assert "rpm taken for rad/s?" in capsys.readouterr().out
    assert run("spoiled.csv", "--map", "bench") == 0  # without a model nobody can know


def test_json_has_the_channels_the_findings_and_the_effects(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("spoiled.csv", "--spec", "small_driveline", "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert found["usable"] is False
    assert [one["kind"] for one in found["findings"]] == ["unit"]
    assert found["channels"][0]["rate"] == pytest.approx(100.0)
    assert found["effects"]["backlash"] == {"testable": True, "needs": []}


def test_without_a_map_columns_are_guessed_by_their_names(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times, values = tip_in()
    columns = {"t_ms": 1e3 * times, "torque_Nm": values["torque"], "motor_rpm": values["motor"]}
    table(project / "plain.csv", columns)
    text = (project / "plain.csv").read_text().splitlines()
    text = [text[0] + ",note", *(line + ",fast" for line in text[1:])]
    (project / "plain.csv").write_text("\n".join(text) + "\n", "utf-8")
    assert run("plain.csv", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert [(c["name"], c["unit"]) for c in found["channels"]] == [
        ("torque_Nm", "N*m"),
        ("motor_rpm", "rpm"),
    ]
    assert found["channels"][0]["rate"] == pytest.approx(100.0)
    assert [one["name"] for one in found["inputs"]] == ["torque_Nm"]


def test_without_a_map_the_columns_of_all_files_are_guessed(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times, values = tip_in()
    both = {"t_ms": 1e3 * times, "torque_Nm": values["torque"]}
    table(project / "first.csv", both)
    table(project / "second.csv", {**both, "motor_rpm": values["motor"]})
    assert run("first.csv", "second.csv", "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert [(c["recording"], c["name"]) for c in found["channels"]] == [
        ("first.csv", "torque_Nm"),
        ("second.csv", "torque_Nm"),
        ("second.csv", "motor_rpm"),
    ]
    assert [(f["recording"], f["channel"], f["kind"]) for f in found["findings"]] == [
        ("first.csv", "motor_rpm", "no_signal")
    ]


def drive_with(project: Path, columns: dict[str, str]) -> str:
    """Write a recording without map, with columns of one text each; return its name."""
    times, values = tip_in()
    table(project / "plain.csv", {"t_s": times, "torque_Nm": values["torque"]})
    head, *rows = (project / "plain.csv").read_text("utf-8").splitlines()
    lines = [",".join([head, *columns]), *(",".join([row, *columns.values()]) for row in rows)]
    (project / "plain.csv").write_text("\n".join(lines) + "\n", "utf-8")
    return "plain.csv"


@pytest.mark.parametrize(
    ("cell", "severity", "reason"),
    [
        ("nan", "error", "has no number: it is all nan"),
        ("", "error", "has no number: it is blank"),
        ("fast", "warning", "has text, such as 'fast'"),
    ],
)
def test_a_column_that_is_left_out_without_a_map_is_named_with_the_reason(
    project: Path, capsys: pytest.CaptureFixture[str], cell: str, severity: str, reason: str
) -> None:
    assert run(drive_with(project, {"speed_rpm": cell})) == (severity == "error")
    text = " ".join(capsys.readouterr().out.split())
    assert f"{severity}: `speed_rpm` (plain.csv): {reason}: left out" in text


def test_a_column_that_is_there_twice_is_named_without_a_map(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = drive_with(project, {})
    rows = [line.split(",") for line in (project / file).read_text("utf-8").splitlines()]
    lines = [",".join([*row, "a_V" if k == 0 else f"{k}", row[1]]) for k, row in enumerate(rows)]
    (project / file).write_text("\n".join(lines) + "\n", "utf-8")
    assert run(file, "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert [(f["kind"], f["channel"]) for f in found["findings"] if f["kind"] == "left_out"] == [
        ("left_out", "torque_Nm")
    ]
    assert "is in the file twice" in str(found["findings"])


def test_columns_beyond_the_first_twelve_are_named(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times, values = tip_in()
    many = {f"c{k}": values["motor"] for k in range(14)}
    table(project / "wide.csv", {"t_s": times, **many})
    assert run("wide.csv") in (0, 1)
    text = " ".join(capsys.readouterr().out.split())
    assert "note: `c12`, `c13` (wide.csv): is not among the first 12 columns: left out" in text


def test_a_second_clock_that_shares_no_time_is_told_without_a_map(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times, values = tip_in()
    wheel = {"t_wheel_s": times, "wheel_rpm": values["wheel"]}
    rest = {"torque_Nm": values["torque"], **wheel}
    table(project / "ms.csv", {"t_s": 1000 * times + 1, **rest})
    assert run("ms.csv") == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "error: the times `t_s` (1 s to 8991 s) and `t_wheel_s` (0 s to 8.99 s) have" in text
    table(project / "unit.csv", {"t_ms": 1000 * times, **rest})
    run("unit.csv")
    assert "in common" not in capsys.readouterr().out


def test_what_cannot_be_read_is_told_with_its_place(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "text.csv").write_text("who,what\nhe,that\n", "utf-8")
    assert run("text.csv") == 1
    assert "text.csv:1:1: error: no column of the recording looks like time" in (
        capsys.readouterr().err
    )
    spec = project / "spec" / "small.yaml"
    spec.write_text(spec.read_text().replace("recording_map: bench\n", ""))
    assert run("drive.csv", "--spec", "small_driveline") == 1
    assert "`small_driveline` names no map of recordings" in capsys.readouterr().err


def test_a_column_that_is_not_there_is_told_with_the_nearest_name(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head, rest = (project / "drive.csv").read_text("utf-8").split("\n", 1)
    misspelt = head.replace("torque", "Torque").replace("wheel", "motor")
    (project / "odd.csv").write_text(f"{misspelt}\n{rest}", "utf-8")
    assert run("odd.csv", "--spec", "small_driveline") == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "there is no column `torque`, which map `bench` reads; did you mean `Torque`?" in text
    assert "error: there are two columns `motor`; rename one of them in the file (odd.csv)" in text
    assert "error: there is no column `wheel`" in text


def test_a_pipe_is_no_recording(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("pipe.csv", "pipe.dat"):  # of .dat the first bytes are looked at
        os.mkfifo(project / name)
        assert run(name, "--map", "bench") == 1
        told = capsys.readouterr().err
        assert (
            f"{name}:1:1: error: the recording cannot be read: it is a folder, a pipe or a device"
            in told
        )


def test_a_loop_of_links_is_no_recording(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (project / "loop.csv").symlink_to("loop.csv")
    for more in (("--map", "bench"), ("--spec", "small_driveline")):
        assert run("loop.csv", *more) == 1
        assert "loop.csv:1:1: error: the recording cannot be read" in capsys.readouterr().err


def write_in_dialect(path: Path) -> Path:
    """Write the drive with semicolons, decimal commas, units and epochs in ms."""
    times, values = tip_in()
    lines = [";".join(["zeit", *values]), ";".join(["ms", *["-" for _ in values]])]
    columns = [1_700_000_000_000 + np.round(1e3 * times), *values.values()]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines += [";".join([f"{row[0]:.0f}", *(f"{v:.9g}" for v in row[1:])]) for row in rows]
    path.write_text("\n".join(lines).replace(".", ",") + "\n", "utf-8")
    return path


def test_what_was_assumed_is_told_in_one_table(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_in_dialect(project / "strange.csv")
    run("strange.csv")
    text = capsys.readouterr().out
    assert text.count("assumed") == 1
    for row in ("separator     semicolon", "decimal sign  comma", "units         line 2"):
        assert f"strange.csv  {row}" in text
    run("strange.csv", "--json")
    found = json.loads(capsys.readouterr().out)
    assert {item["subject"] for item in found["assumptions"]} == {
        "separator",
        "decimal sign",
        "units",
    }


def test_nothing_is_told_of_a_plain_file(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("drive.csv")
    assert "assumed" not in capsys.readouterr().out


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("s", 1.0)])
def test_an_epoch_without_a_map_is_taken_in_its_unit(
    project: Path, capsys: pytest.CaptureFixture[str], unit: str, factor: float
) -> None:
    times, values = tip_in()
    lines = [",".join(["time", *values])]
    for k, time in enumerate(times.tolist()):
        stamp = f"{factor * (1.7e9 + round(time, 3)):.{0 if factor > 1 else 3}f}"
        lines.append(",".join([stamp, *(f"{column[k]:.9g}" for column in values.values())]))
    (project / "epoch.csv").write_text("\n".join(lines) + "\n", "utf-8")
    run("epoch.csv")
    text = capsys.readouterr().out
    assert "100 Hz" in text
    assert ("is taken in" in text) == (unit != "s")


def test_a_unit_that_is_not_understood_is_told_without_a_map(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(project / "unit.csv")
    head, _, rest = path.read_text("utf-8").partition("\n")
    units = ",".join(["s", "furlong", *["-" for _ in head.split(",")[2:]]])
    path.write_text(f"{head}\n{units}\n{rest}", "utf-8")
    run("unit.csv")
    assert "has the unit `furlong`, which is not understood" in capsys.readouterr().out


def test_a_channel_with_words_among_its_numbers_is_left_out(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asammdf, np = pytest.importorskip("asammdf"), pytest.importorskip("numpy")
    stamps = np.arange(300) * 0.01
    words = {"val_0": 5, "text_0": "red", "default": None}
    raw = np.where(np.arange(300) < 10, 5, 7).astype("u1")
    signals = [
        asammdf.Signal(80 * np.sin(stamps), stamps, "Nm", "torque"),
        asammdf.Signal(raw, stamps, name="lamp", conversion=words),
    ]
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append(signals)
        mdf.save(project / "lamp.mf4")
    run("lamp.mf4")
    text = " ".join(capsys.readouterr().out.split())
    assert "`lamp` (lamp.mf4): has text, such as `red`: left out" in text.replace("'", "`")
    assert "not a finite number" not in text


def test_the_unit_of_time_of_a_table_of_frames_is_told(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [f"{1000 + 10 * k},0x100,{k % 200:02x} 00" for k in range(300)]
    (project / "frames.csv").write_text("\n".join(["Time,ID,Data", *rows]) + "\n", "utf-8")
    dbc = 'VERSION ""\nNS_ :\nBS_:\nBU_: E\nBO_ 256 M: 2 E\n SG_ u : 0|8@1+ (1,0) [0|0] "Nm" E\n'
    (project / "car.dbc").write_text(dbc, "utf-8")
    run("frames.csv", "--dbc", "car.dbc")
    text = " ".join(capsys.readouterr().out.split())
    assert "the time `Time` is taken in ms: 100 frames a second fit a bus" in text


@pytest.mark.parametrize("command", ["check", "map"])
@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "loop", "dangling", "empty"])
def test_what_is_no_file_is_refused(project: Path, command: str, kind: str) -> None:
    path = project / "odd.csv"
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "empty":
        path.touch()
    else:
        path.symlink_to({"device": "/dev/zero", "loop": "odd.csv", "dangling": "no.csv"}[kind])
    words = ["recording", command, "odd.csv"]
    words += ["--spec", "small_driveline"] if command == "map" else []
    code = run_with_exit_code(lambda: app(words, standalone_mode=False))
    assert code == 1


@pytest.mark.parametrize("name", ["a\nb.csv", "a\tb.csv", "a\x1b[31m.csv", "a\u202eb.csv"])
def test_a_name_of_a_file_stays_on_its_line(
    project: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (project / name).write_bytes((project / "drive.csv").read_bytes()[:2000])
    run(name)
    text = capsys.readouterr().out
    assert ascii(name)[1:-1].replace("\\n", "\\x0a").replace("\\t", "\\x09") in text
    assert name not in text


def test_a_quiet_check_prints_errors_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.csv").write_text("t_s,speed\n0,1\n", "ascii")
    line = partial(app, ["--quiet", "recording", "check", "one.csv"], standalone_mode=False)
    assert run_with_exit_code(line) == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    errors = printed.err.splitlines()
    assert errors and all(error.startswith("error: ") for error in errors)
