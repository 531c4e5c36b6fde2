"""Every exit code, as a user meets it: 0, 1, 2, 3, 4, 130."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from modewright.api import pass_output as explaining
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

ROOT = Path(__file__).parents[3]
TRACE = ROOT / "tests" / "data" / "paper" / "est_paper_tip_out_1kHz.csv.gz"
COMMANDS = ("check", "simulate", "lockstep", "replay", "generate", "explain", "demo")


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))


def test_a_check_without_problems_is_0() -> None:
    assert run("check", "contactor") == 0


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_every_command_names_the_exit_codes(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(command, "--help") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "0 done; 1 the spec or data has problems" in text
    assert "130 interrupted" in text


def bad_specs(folder: Path) -> dict[str, Path]:
    made = {name: folder / f"{name}.yaml" for name in ("empty", "binary", "unit", "missing")}
    made["empty"].write_text("")
    made["binary"].write_bytes(bytes(range(256)))
    text = (ROOT / "spec" / "ev_driveline" / "plant.yaml").read_text()
    made["unit"].write_text(text.replace("{value: 1250 kg,", "{value: 1250 s,"))
    return made


@pytest.mark.parametrize("name", ["empty", "binary", "unit", "missing"])
def test_a_bad_spec_is_1_with_its_place(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = bad_specs(tmp_path)[name]
    assert run("check", str(path)) == 1
    assert f"{name}.yaml:" in capsys.readouterr().err


RECORDINGS = {
    "missing": None,
    "empty": b"",
    "binary": bytes(range(256)),
    "unknown_column": b"t,T_em\n0,1\n",
    "nan": b"t,T_em,T_br,y_w_em,y_w_w,T_hs,theta_b\n0,1,0,nan,3,0,0\n",
    "unsorted": b"t,T_em,T_br,y_w_em,y_w_w,T_hs,theta_b\n1,1,0,2,3,0,0\n0,1,0,2,3,0,0\n",
}


@pytest.mark.parametrize("name", RECORDINGS)
def test_a_bad_recording_is_1_and_nothing_is_written(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "drive.csv", tmp_path / "out.csv"
    data = RECORDINGS[name]
    if data is not None:
        path.write_bytes(data)
    code = run("replay", "estimator", str(path), "--map", "reference_trace", "--out", str(out))
    assert code == 1
    assert "drive.csv:" in capsys.readouterr().err
    assert {entry.name for entry in tmp_path.iterdir()} <= {"drive.csv"}


def test_a_wrong_unit_in_a_map_is_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / "spec" / "ev_driveline" / "map_reference.yaml").read_text()
    path = tmp_path / "map.yaml"
    path.write_text(text.replace("to: y_em, unit: rad/s", "to: y_em, unit: km/h"))
    assert run("replay", "estimator", str(TRACE), "--map", str(path)) == 1
    assert "column `y_w_em` is in `m/s`" in capsys.readouterr().err


def test_an_output_that_cannot_be_written_is_1_before_any_work(tmp_path: Path) -> None:
    out = tmp_path / "absent" / "out.csv"
    assert run("simulate", "ev_driveline", "-s", "tip_out", "--out", str(out)) == 1
    assert run("simulate", "ev_driveline", "-s", "tip_out", "--out", str(tmp_path)) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder without a project."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", "--all"),
        ("check", "--all", "--json"),
        ("generate", "--all"),
        ("generate", "--all", "--check"),
        ("format", "."),
        ("test",),
    ],
)
def test_a_folder_without_specs_is_1(
    arguments: tuple[str, ...], empty_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 1
    assert re.search("there is no (spec|test) below", "".join(capsys.readouterr()))
    assert list(empty_folder.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulate", "ev_driveline", "-s", "tip_out", "--plot", "a.gif"),
        ("replay", "estimator", str(TRACE), "--map", "reference_trace", "--plot", "a.gif"),
        ("recording", "check", str(TRACE), "--plot", "a.gif"),
        ("plot", "ev_driveline:tip_out", "--out", "a.gif"),
    ],
)
@pytest.mark.usefixtures("empty_folder")
def test_a_picture_of_another_format_is_1_before_any_work(
    arguments: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    assert run(*arguments) == 1
    assert "a.gif: a picture ends with .png, .svg, .pdf" in capsys.readouterr().err


def test_problems_are_json_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = bad_specs(tmp_path)["unit"]
    assert run("check", str(path), "--json") == 1
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert problems and {"severity", "file", "line", "column", "message"} <= set(problems[0])


@pytest.mark.parametrize(
    "arguments",
    [
        ("bogus",),
        ("simulate", "ev_driveline"),
        ("generate",),
        ("check",),
        ("simulate", "ev_driveline", "-s", "tip_out", "--set", "k_hs"),
    ],
)
def test_wrong_usage_is_2(arguments: tuple[str, ...]) -> None:
    assert run(*arguments) == 2


def test_an_unknown_parameter_is_1_with_the_nearest_name(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("simulate", "ev_driveline", "-s", "tip_out", "--set", "k_h=1 N*m/rad") == 1
    assert "did you mean `k_hs`?" in capsys.readouterr().err


def test_a_missing_compiler_is_3_with_its_install_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    assert run("replay", "estimator", str(TRACE), "--map", "reference_trace") == 3
    assert "apt-get install" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["false", "true", "'"])
def test_a_compiler_that_does_not_work_is_3_with_the_reason(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", command)
    assert run("lockstep", "ev_driveline", "-s", "tip_out") == 3
    assert f"error: the C compiler `{command}` " in capsys.readouterr().err


def test_no_folder_for_temporary_files_is_1_with_the_reason() -> None:
    code = (
        "import tempfile\n"
        "tempfile._candidate_tempdir_list = lambda: ['/proc/nowhere']\n"
        "from modewright.cli.app import main\n"
        "main()\n"
    )
    command = [sys.executable, "-c", code, "lockstep", "ev_driveline", "-s", "tip_out"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    assert "free space, or set TMPDIR" in done.stderr and done.stderr.count("\n") == 1


def test_a_large_run_is_announced_before_it_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("engine.simulation.simulate._Simulation.run", stop)
    assert run("new", "warm", "--out", str(tmp_path / "warm")) == 0
    monkeypatch.chdir(tmp_path / "warm")
    scenario = "language: 1\nscenario: long\nof: warm\nhorizon: 6 h\nrecord: {every: 1 ms}\n"
    Path("spec", "long.yaml").write_text(scenario)
    assert run("simulate", "warm", "-s", "long", "--interpreted") == 130
    (warning,) = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert "the run records 21600001 rows, 173 MB for each signal" in warning


def test_a_defect_without_a_folder_for_its_report_is_4(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("seven")

    monkeypatch.setattr(explaining, "explain_spec", broken)
    monkeypatch.setattr(tempfile, "tempdir", "/proc/nowhere")
    assert run("explain", "estimator") == 4
    assert "no report can be written: " in capsys.readouterr().err


def test_a_defect_of_ours_is_4_with_a_report(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("seven")

    monkeypatch.setattr(explaining, "explain_spec", broken)
    assert run("explain", "estimator") == 4
    first, second = capsys.readouterr().err.splitlines()
    assert first == "error: a defect of modewright: ZeroDivisionError: seven"
    report = Path(second.removeprefix("a report is in "))
    assert "ZeroDivisionError: seven" in report.read_text()
    report.unlink()


@pytest.mark.long
def test_an_interrupt_is_130() -> None:
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
    code += "import sys; sys.argv = ['modewright', 'demo', '--out', 'build'];"
    code += "print('ready', flush=True); from modewright.cli.app import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT
    )
    assert process.stdout
    while b"Tip-out" not in process.stdout.readline():
        assert process.poll() is None
    os.kill(process.pid, signal.SIGINT)
    deadline = time.monotonic() + 30
    while process.poll() is None and time.monotonic() < deadline:
        process.stdout.read(1)
    assert process.wait(timeout=30) == 130
    process.stdout.close()
    assert process.stderr
    process.stderr.close()
