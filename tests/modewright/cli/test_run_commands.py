"""Commands: options and files that are wrong usage."""

from __future__ import annotations

import json
import math
from importlib import metadata
from pathlib import Path

import pytest

from diagnosis.criterion.threshold import read_thresholds
from language.text.diagnostic import DataError
from modewright.api import doctor
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

ROWS = "t [s],p.T [N*m]\n0.0,1.0\n0.1,2.0\n"


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(arguments, standalone_mode=False))


@pytest.fixture(autouse=True)
def _in_a_folder_with_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.csv").write_text(ROWS)


@pytest.mark.parametrize(
    "arguments",
    [
        ("--tolerance", "*.T=-1"),
        ("--tolerance", "*=nan"),
        ("--tolerance", "*=inf"),
        ("--relative", "inf"),
        ("--relative", "nan"),
        ("--slack", "nan"),
    ],
)
def test_a_tolerance_that_is_negative_or_not_finite_is_wrong_usage(
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("compare", "run.csv", "run.csv", *arguments) == 2
    assert "Invalid value" in capsys.readouterr().err
    assert run("compare", "run.csv", "run.csv", "--tolerance", "*.T=0.5") == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("simulate", "a", "-s", "b", "--reference", "--compiled"), "leave out --compiled"),
        (("simulate", "a", "-s", "b", "--reference", "--interpreted"), "leave out --interpreted"),
        (("simulate", "a", "-s", "b", "--method", "DOP853", "--compiled"), "leave out --compiled"),
        (("simulate", "a", "-s", "b", "--reference", "--method", "RK4"), "leave out --method RK4"),
        (("-q", "-v", "check", "--all"), "leave out one"),
        (("check", "--all", "--json", "--github"), "leave out one"),
        (("trace", "a", "--keys", "--strict"), "leave it out: --keys"),
        (("trace", "a", "--keys", "--requirements", "needs.csv"), "leave it out: --keys"),
        (("fit", "a", "--train", "run.csv", "--name", "rig_7"), "goes with --out"),
        (("fit", "a", "--train", "run.csv", "--date", "2026-11-21"), "goes with --out"),
    ],
)
def test_an_option_that_would_have_no_effect_is_wrong_usage(
    arguments: tuple[str, ...], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 2
    assert told in capsys.readouterr().err.replace("\n", " ")


@pytest.mark.parametrize(
    ("text", "options", "code", "told"),
    [
        (ROWS, ("--from", "5"), 2, "no sample lies in 5 s to inf s: they cover 0 s to 0.1 s"),
        (ROWS[: ROWS.index("\n") + 1], (), 1, "`run.csv` has no samples"),
        ("t [s]\n0.0\n0.1\n", (), 1, "`run.csv` has no signals"),
        (f"{ROWS}0.05,1.0\n", (), 1, "run.csv:4:1: "),
    ],
)
def test_a_figure_of_nothing_is_refused(
    text: str, options: tuple[str, ...], code: int, told: str,
    tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (tmp_path / "run.csv").write_text(text)
    assert run("plot", "run.csv", *options) == code
    assert told in capsys.readouterr().err.replace("\n", " ")
    assert not (tmp_path / "plot.png").exists()


def test_equal_specs_have_no_differences(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (
        ("diff", "estimator", "estimator"),
        ("explain", "estimator", "estimator"),
        ("explain", "estimator", "estimator", "--pass", "model"),
    ):
        assert run(*arguments) == 0
        assert capsys.readouterr().out == "no differences\n"


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--version") == 0
    assert capsys.readouterr().out == f"modewright {metadata.version('modewright')}\n"


def test_an_identifier_that_is_no_number_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("dbc", "supervisor", "--first", "abc", "--out", "a.dbc") == 2
    assert "`abc` is not a whole number such as `0x320`" in capsys.readouterr().err


def test_a_dependency_of_several_extras_is_checked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = ["pyarrow>=1; extra == 'a'", "numpy", "pyarrow>=1; extra == 'b'"]
    monkeypatch.setattr(metadata, "requires", lambda name: lines)
    assert [check.name for check in doctor._check_dependencies()] == ["pyarrow", "numpy"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("t [s],p.T [N*m]\n", "a run without samples"),
        ("t [s],p.T [N*m]\n7.0,1.0\n", "no time in common"),
        ("t [s],p.w [rad/s]\n0.0,1.0\n", "no signal in common"),
        ("t [s],p.T [N]\n0.0,1.0\n", "is in `N*m` and in `N`"),
    ],
)
def test_what_the_data_of_two_runs_prevent_has_code_1(
    text: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("other.csv").write_text(text)
    assert run("compare", "run.csv", "other.csv") == 1
    assert reason in capsys.readouterr().err
    assert run("compare", "run.csv", "run.csv", "--align") == 0


def test_a_file_without_thresholds_has_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    Path("limits.json").write_text("{}")
    with pytest.raises(DataError, match="holds no thresholds"):
        read_thresholds(Path("limits.json"))


def test_the_time_shift_of_two_runs_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [(0.01 * k, math.exp(-((k - 50.0) ** 2) / 50.0)) for k in range(200)]
    for name, offset in (("a.csv", 0.0), ("b.csv", 0.3)):
        lines = [f"{time + offset!r},{value!r}" for time, value in rows]
        Path(name).write_text("\n".join(["t [s],p.T [N*m]", *lines]) + "\n")
    assert run("compare", "a.csv", "b.csv", "--align", "--relative", "1e-6") == 0
    assert "the times of B are shifted by -0.3 s, with a correlation of 1" in (
        capsys.readouterr().out
    )
    assert run("compare", "a.csv", "b.csv", "--align", "--relative", "1e-6", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["offset"] == pytest.approx(-0.3) and found["correlation"] > 0.999
    assert run("compare", "a.csv", "b.csv", "--offset=-0.3", "--relative", "1e-6") == 0
    assert "the times of B are shifted by -0.3 s\n" in capsys.readouterr().out
    assert run("compare", "a.csv", "b.csv", "--offset", "1", "--align") == 2
    assert run("compare", "a.csv", "b.mf4") == 2
    assert "an MF4 has no transitions" in " ".join(capsys.readouterr().err.split())
