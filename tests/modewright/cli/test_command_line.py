"""The command line as a user meets it: quick help, quiet pipes, pictures and comparisons."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import modewright as mw
from modewright.cli.app import COMMANDS, app, build_application
from modewright.cli.common.exit_codes import run_with_exit_code

ROOT = Path(__file__).parents[3]
HEAVY = ("scipy", "matplotlib", "numpy", "networkx", "pint", "lark", "jinja2", "rich.console")


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="module")
def tip_out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.csv"
    mw.save(mw.simulate("ev_driveline", "tip_out", root=ROOT), path)
    return path


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))


def test_a_working_folder_that_was_deleted_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    for line in (["check", "estimator"], ["demo", "recordings"], ["compare", "a.csv", "b.csv"]):
        assert run(*line) == 1
        assert "the current folder does not exist any more" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["", "nothing"])
def test_an_unknown_pass_is_an_error_of_usage(name: str) -> None:
    assert run("explain", "estimator", "--stop-after", name) == 2
    assert run("explain", "estimator", "--pass", name) == 2


def test_help_loads_no_heavy_module() -> None:
    code = "import sys; sys.argv = ['modewright', '--help']\n"
    code += "from modewright.cli.app import main\n"
    code += "try: main()\nexcept SystemExit: print(sorted(sys.modules), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "Usage: modewright" in done.stdout
    assert [name for name in HEAVY if f"'{name}'" in done.stderr] == []


def test_main_has_the_help_of_the_whole_application(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--help") == 0
    whole = capsys.readouterr().out.split("Usage: ")[1].split(" ", 1)[1]
    done = subprocess.run(
        [sys.executable, "-m", "modewright", "--help"], capture_output=True, text=True, check=True
    )
    assert done.stdout.split("Usage: ")[1].split(" ", 1)[1].split("\n")[2:] == whole.split("\n")[2:]


def test_a_command_is_whole_wherever_its_name_is_among_the_words() -> None:
    assert [len(params_of(name)) for name in ("check", "simulate", "graph")] == [0, 0, 0]
    assert len(params_of("check", "--log-file", "check", "simulate")) > 3
    assert len(params_of("simulate", "--log-file", "check", "simulate")) > 3
    assert len(params_of("graph", "--log-file", "check", "simulate")) == 0


def test_numbers_that_a_command_takes_by_default_are_those_of_its_function() -> None:
    compared = 0
    for command in COMMANDS:
        function = getattr(mw, command.__name__, None)
        of_function = inspect.signature(function).parameters if callable(function) else {}
        for name, option in inspect.signature(command).parameters.items():
            own = of_function.get(name)
            if own and {type(own.default), type(option.default)} <= {int, float}:
                assert option.default == own.default, (command.__name__, name)
                compared += 1
    assert compared >= 3


def params_of(name: str, *words: str) -> list[object]:
    """Return the parameters (but --help) of a command of the application made for some words."""
    group = typer.main.get_command(build_application(words))
    return [p for p in group.commands[name].params if p.name != "help"]  # type: ignore[attr-defined]


def test_importing_the_package_loads_nothing_until_a_name_is_used() -> None:
    code = "import modewright as mw, sys; print('numpy' in sys.modules); mw.Trajectory;"
    code += "print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]


def test_every_public_name_is_there_and_described() -> None:
    for name in mw.__all__:
        assert getattr(mw, name).__doc__, name
    with pytest.raises(AttributeError):
        mw.no_such_name  # noqa: B018


@pytest.mark.parametrize("command", [command.__name__ for command in COMMANDS])
def test_every_help_has_an_example_that_starts_with_the_command(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(command, "--help") == 0
    assert f"\n  modewright {command}" in capsys.readouterr().out


def test_quiet_tells_nothing_and_the_log_file_tells_what_was_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log.txt"
    assert run("--quiet", "--log-file", str(log), "check", "estimator") == 0
    assert capsys.readouterr().out == ""
    assert "command:" in log.read_text()
    assert run("check", "estimator") == 0
    assert "1 spec checked, 0 problems" in capsys.readouterr().out


def test_a_pipe_gets_no_colour_and_no_bar() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "modewright", "compare", "ev_driveline:tip_out", "nowhere.csv"],
        capture_output=True, text=True, cwd=ROOT, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "\x1b" not in done.stdout + done.stderr
    assert "nowhere.csv:1:1: error: the run cannot be read" in done.stderr


@pytest.mark.long
def test_a_file_does_not_differ_from_the_same_simulation(
    tip_out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "apart.svg"
    code = run("compare", str(tip_out), "ev_driveline:tip_out", "--plot", str(picture), "--json")
    assert code == 0
    found = json.loads(capsys.readouterr().out)
    assert found["within"] is True
    assert {signal["largest"] for signal in found["signals"]} == {0.0}
    assert picture.read_bytes().startswith(b"<?xml")


def test_a_changed_value_is_1_and_named_with_its_time(
    tip_out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changed = tmp_path / "changed.csv"
    lines = tip_out.read_text().splitlines()
    cells = lines[11].split(",")
    cells[1] = repr(float(cells[1]) + 1.0)
    changed.write_text("\n".join([*lines[:11], ",".join(cells), *lines[12:]]) + "\n")
    arguments = ["compare", str(tip_out), str(changed), "--signals", "plant.w_em"]
    assert run(*arguments) == 1
    assert "they part at 0.005 s: plant.w_em" in capsys.readouterr().out
    assert run(*arguments, "--tolerance", "plant.*=1.01") == 0


def test_a_plot_of_two_runs_is_written(tip_out: Path, tmp_path: Path) -> None:
    out = tmp_path / "both.png"
    window = ["--signals", "plant.T_hs", "--from", "0.4", "--to", "1.2", "--out", str(out)]
    assert run("plot", str(tip_out), str(tip_out), *window) == 0
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "arguments",
    [
        ("plot", "what"),
        ("plot", "RUN", "--signals", "nope"),
        ("plot", "RUN", "--from", "2", "--to", "1"),
        ("compare", "RUN", "RUN", "--tolerance", "plant.T_hs"),
        ("compare", "RUN", "RUN", "--tolerance", "nope=1"),
        ("compare", "RUN", "RUN", "--from", "99"),
    ],
)
def test_wrong_usage_of_runs_is_2_and_writes_nothing(
    arguments: tuple[str, ...], tip_out: Path, tmp_path: Path
) -> None:
    given = [str(tip_out) if argument == "RUN" else argument for argument in arguments]
    option = "--plot" if given[0] == "compare" else "--out"
    assert run(*given, option, str(tmp_path / "picture.png")) == 2
    assert list(tmp_path.iterdir()) == []


def test_a_run_in_an_unknown_format_is_refused_before_any_work(tmp_path: Path) -> None:
    out = str(tmp_path / "run.xlsx")
    assert run("simulate", "ev_driveline", "-s", "tip_out", "--out", out) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_new_project_has_no_problem_simulates_and_its_tests_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("new", "warm_room") == 0
    monkeypatch.chdir(tmp_path / "warm_room")
    assert run("check", "--all") == 0
    assert run("simulate", "warm_room", "-s", "cold_day", "--out", "run.csv") == 0
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "3 passed" in done.stdout


@pytest.mark.parametrize(("name", "code"), [("1st", 2), ("a-b", 2), ("room", 2), ("there", 1)])
def test_a_project_that_cannot_be_made_leaves_nothing(
    name: str, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    assert run("new", name) == code
    assert [path.name for path in tmp_path.iterdir()] == ["there"]
    assert list((tmp_path / "there").iterdir()) == []


def test_the_doctor_finds_everything_in_order_and_tests_itself(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("doctor", "--json") == 0
    found = {item["name"]: item for item in json.loads(capsys.readouterr().out)["findings"]}
    assert {item["verdict"] for item in found.values()} == {"ok"}
    assert found["self-test"]["message"].endswith("values in engine and C, 0 differ")
    assert {"python", "modewright", "numpy", "pyarrow", "C compiler", "cache"} <= set(found)


def test_the_doctor_says_what_is_missing_and_what_helps(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    assert run("doctor") == 3
    assert "apt-get install gcc" in capsys.readouterr().out
    monkeypatch.delenv("CC")
    open_to_all = tmp_path / "open"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    monkeypatch.setenv("MODEWRIGHT_CACHE", str(open_to_all))
    assert run("doctor") == 1
    assert "chmod 700" in capsys.readouterr().out
