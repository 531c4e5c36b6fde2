"""Parameters are fitted within their ranges, and it is told what data cannot determine."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import modewright as mw
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.diagnosis.rotor_project import B, J, write_project

MORE = "b: {value: 0.1 N*m*s/rad, range: [0.01, 0.5]}\n  T_0: {value: 1 N*m, range: [0.5, 2]}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rotor without dry friction; its spec has a torque `T_0` that is as good as absent."""
    made = write_project(tmp_path_factory.mktemp("fit") / "project", T_c=0.0)
    path = made / "spec" / "spinner.yaml"
    text = path.read_text("utf-8").replace("b: {value: 0.1 N*m*s/rad, range: [0.01, 0.5]}", MORE)
    path.write_text(text.replace("T - b * w", "T - b * w - 0.000001 * T_0"), "utf-8")
    return made


@pytest.fixture(autouse=True)
def _there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)


def test_values_are_found_within_their_deviation_and_what_is_not_known_is_told() -> None:
    found = mw.fit("spinner", ["run_0.csv", "run_1.csv"])
    by_name = {one.name: one for one in found.parameters}
    for name, true in (("J", J), ("b", B)):
        one = by_name[name]
        assert abs(one.quantity.value - true) < 4.0 * one.quantity.std, one
        assert one.quantity.std < 0.02 * true
    assert found.undetermined == ("T_0",)
    assert by_name["T_0"].prior_ratio == pytest.approx(1.0, abs=0.01)
    assert by_name["T_0"].quantity.value == pytest.approx(1.0, rel=0.01)
    assert found.misfits["w"].nrmse_after < 0.1 * found.misfits["w"].nrmse_before


def test_only_those_named_move_and_the_calibration_is_a_spec(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["fit", "spinner", "--train", "run_0.csv", "--parameters", "J"]
    words += ["--out", "rig_7.yaml", "--date", "2026-11-21"]
    assert run_with_exit_code(lambda: app(words, standalone_mode=False)) == 0
    text = (folder / "rig_7.yaml").read_text("utf-8")
    assert "calibration: rig_7\nof: spinner\n" in text
    assert 'from: "run_0.csv"\ndate: 2026-11-21\n' in text
    assert "  b:" not in text and "  J: {value: 0.5" in text and "std: 0.0" in text
    assert mw.check("rig_7.yaml") == []
    assert "as fitted" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--parameters", "J,bb"], "command line:1:1: error: `spinner` has no parameter `bb`"),
        (["--parameters", "quark"], "help: parameters that can be fitted: "),
        (["--parameters", "J,,b"], "`J,,b` has an empty name"),
        (["--parameters", "J,b,J"], "`J` is named twice"),
        (["--out", "rig.txt"], "rig.txt: a calibration ends with .yaml"),
        (["--out", "rig.yaml", "--name", "rig 7"], "`rig 7` is not a name"),
        (["--out", "rig.yaml", "--date", "21.11.2026"], "a date is written as"),
        (["--name", "rig_7"], "goes with --out"),
    ],
)
def test_what_cannot_be_fitted_is_told(
    words: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["fit", "spinner", "--train", "run_0.csv", *words]
    assert run_with_exit_code(lambda: app(command, standalone_mode=False)) in (1, 2)
    assert told in capsys.readouterr().err


def test_a_parameter_without_a_range_is_not_fitted(folder: Path) -> None:
    path = folder / "spec" / "spinner.yaml"
    fixed = path.read_text("utf-8").replace("automaton: spinner", "automaton: stiff")
    (folder / "stiff.yaml").write_text(fixed.replace(", range: [0.3, 0.8]", ""), "utf-8")
    with pytest.raises(mw.SpecError) as refused:
        mw.fit("stiff.yaml", ["run_0.csv"], ["J"])
    assert [p.label for p in refused.value.problems] == ["`J` has no range to be fitted in"]


@pytest.mark.parametrize("command", [["recording", "check", "--spec"], ["fit"], ["diagnose"]])
def test_a_map_of_another_spec_is_told_with_its_lines(
    command: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (folder / "spec" / "bench_columns.yaml").read_text("utf-8")
    other = text.replace("map: bench_columns", "map: other").replace("to: T,", "to: torque,")
    (folder / "other.yaml").write_text(other.replace("unit: rad/s", "unit: m"), "utf-8")
    files = ["run_0.csv"] if command[0] == "recording" else ["--train", "run_0.csv"]
    out = ["--out", "odd"] if command[0] == "diagnose" else []
    words = [*command, "spinner", *files, "--map", "other.yaml", *out]
    assert run_with_exit_code(lambda: app(words, standalone_mode=False)) == 1
    told = capsys.readouterr().err
    assert "other.yaml:2:6: error: map `other` gives no value for input `T` of `spinner`" in told
    assert "other.yaml:4:11: error: `torque` is not an input of `spinner` [MW115]" in told
    assert "column `speed` is in `m` [MW305]" in told


def test_nothing_is_fitted_to_recordings_with_errors_but_anyway(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = (folder / "run_0.csv").read_text("utf-8").splitlines()
    cells = (line.split(",") for line in lines[1:])
    still = "\n".join(f"{time},3,{speed}" for time, _, speed in cells)
    (folder / "still.csv").write_text(f"t_s,torque,speed\n{still}\n", "utf-8")
    command = ["fit", "spinner", "--train", "still.csv", "--parameters", "b", "--out", "still.yaml"]
    assert run_with_exit_code(lambda: app(command, standalone_mode=False)) == 1
    assert "the recordings are not usable; nothing was fitted" in capsys.readouterr().err
    assert not (folder / "still.yaml").exists()
    assert run_with_exit_code(lambda: app([*command, "--anyway"], standalone_mode=False)) == 0
    assert mw.check("still.yaml") == []


def test_recordings_with_errors_are_left_out_of_more(folder: Path) -> None:
    lines = (folder / "run_2.csv").read_text("utf-8").splitlines()
    (folder / "short.csv").write_text("\n".join(lines[:60]) + "\n", "utf-8")
    told: list[str] = []
    found = mw.fit("spinner", ["run_0.csv", "run_1.csv", "short.csv"], ["b"], tell=told.append)
    assert list(found.inputs) == ["run_0.csv", "run_1.csv"]
    assert "left out: short.csv" in told


def test_a_deviation_that_is_no_number_is_not_written() -> None:
    found = mw.fit("spinner", ["run_0.csv"], ["b"])
    (one,) = found.parameters
    quantity = dataclasses.replace(one.quantity, std=float("nan"))
    lost = dataclasses.replace(one, quantity=quantity, prior_ratio=float("nan"))
    lost_fit = dataclasses.replace(found, parameters=(lost,))
    assert "std" in found.calibration("rig")
    assert "nan" not in lost_fit.calibration("rig")
    assert lost_fit.undetermined == ("b",)
