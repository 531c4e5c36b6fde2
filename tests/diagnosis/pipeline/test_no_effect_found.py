"""What a user gets where no effect is named: nothing missing, no time, wrong data, wrong words."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

from tests.diagnosis.rotor_project import COMMAND, SCHEMA, T_C, run_command, write_project


def test_a_model_that_lacks_nothing_is_told_so(tmp_path: Path) -> None:
    folder = write_project(tmp_path / "clean", T_c=0.0)
    assert run_command(folder, *COMMAND, "--out", "found", "--fail-on", "effect") == 0
    verdict = json.loads((folder / "found" / "verdict.json").read_text("utf-8"))
    jsonschema.validate(verdict, SCHEMA)
    assert verdict["verdict"] == "nothing_missing"
    assert verdict["confirmed"] is None
    assert "effects:" not in (folder / "found" / "variant.yaml").read_text("utf-8")
    assert "lacks nothing" in (folder / "found" / "report.html").read_text("utf-8")


@pytest.mark.parametrize("seen", [0.0, 7.5])
def test_a_signal_that_never_moves_is_no_defect_of_ours(tmp_path: Path, seen: float) -> None:
    folder = write_project(tmp_path / "still", T_c=0.0)
    for k in range(2):
        rows = [f"{i / 100:.2f},0,{seen}" for i in range(1000 + k)]
        text = "t_s,torque,speed\n" + "\n".join(rows) + "\n"
        (folder / f"run_{k}.csv").write_text(text, "utf-8")
    assert run_command(folder, *COMMAND, "--out", "found", "--anyway") == 0


def test_a_torque_that_acts_in_windows_is_an_unknown_input(tmp_path: Path) -> None:
    folder = write_project(tmp_path / "struck", T_c=0.0, hit=3.0)
    assert run_command(folder, *COMMAND, "--out", "found") == 0
    verdict = json.loads((folder / "found" / "verdict.json").read_text("utf-8"))
    jsonschema.validate(verdict, SCHEMA)
    (effect,) = verdict["effects"]
    assert (effect["id"], effect["place"]) == ("unknown_input", "flow.w")
    loud = [window for window in verdict["location"]["windows"] if window[1] - window[0] > 0.5]
    assert {(round(start), file) for start, _, file in loud} == {(2, "run_0.csv"), (5, "run_1.csv")}
    assert run_command(folder, "check", "found/variant.yaml") == 0


@pytest.mark.long
def test_a_torque_that_acts_in_windows_is_found_beside_a_friction_that_acts_always(
    tmp_path: Path,
) -> None:
    folder = write_project(tmp_path / "both", hit=3.0)
    assert run_command(folder, *COMMAND, "--out", "found") == 0
    verdict = json.loads((folder / "found" / "verdict.json").read_text("utf-8"))
    found = {effect["id"]: effect["parameters"] for effect in verdict["effects"]}
    assert found.keys() == {"unknown_input", "coulomb_friction"}
    assert found["coulomb_friction"]["T_c"]["value"] == pytest.approx(T_C, rel=0.1)
    loud = [window for window in verdict["location"]["windows"] if window[1] - window[0] > 0.5]
    assert {(round(start), file) for start, _, file in loud} == {(2, "run_0.csv"), (5, "run_1.csv")}
    assert run_command(folder, "check", "found/variant.yaml") == 0


def test_what_is_held_out_and_cannot_be_used_is_told_on_the_screen_and_in_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_project(tmp_path / "broken", T_c=0.0)
    (folder / "run_2.csv").write_text("t_s,torque,speed\n0,1,2\n", "utf-8")
    assert run_command(folder, *COMMAND, "--out", "found") == 0
    told = (
        "run_2.csv was held out and cannot be used: `speed` has 1 of the 10 samples that are needed"
    )
    assert told in capsys.readouterr().err
    page = (folder / "found" / "report.html").read_text("utf-8")
    assert told.replace("`", "") in page.replace("`", "")


@pytest.mark.long
def test_a_spec_without_a_range_is_diagnosed_as_it_is(tmp_path: Path) -> None:
    folder = write_project(tmp_path / "exact")
    path = folder / "spec" / "spinner.yaml"
    text = (
        path.read_text("utf-8").replace("range: [0.3, 0.8]", "").replace("range: [0.01, 0.5]", "")
    )
    path.write_text(text.replace("0.5 kg*m^2,", "0.55 kg*m^2").replace("rad, }", "rad}"), "utf-8")
    assert run_command(folder, *COMMAND, "--out", "found") == 0
    verdict = json.loads((folder / "found" / "verdict.json").read_text("utf-8"))
    assert verdict["verdict"] in ("effect", "ambiguous")


def test_a_budget_that_is_over_leaves_what_was_found_and_what_to_go_on_from(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_project(tmp_path / "hasty")
    assert run_command(folder, *COMMAND, "--out", "found", "--budget", "0 s") == 0
    verdict = json.loads((folder / "found" / "verdict.json").read_text("utf-8"))
    jsonschema.validate(verdict, SCHEMA)
    assert (verdict["verdict"], verdict["effects"], verdict["confirmed"]) == ("unknown", [], None)
    assert verdict["messages"][0] == "not finished: the 0 s of its budget are over"
    told = capsys.readouterr()
    assert told.out.startswith("Nothing is concluded yet: the 0 s of its budget are over")
    assert "goes on from there" in told.out and "held out" not in told.err
    page = (folder / "found" / "report.html").read_text("utf-8")
    assert "Nothing is concluded yet" in page


def test_no_physics_is_blamed_for_a_wrong_unit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_project(tmp_path / "wrong")
    path = folder / "spec" / "bench_columns.yaml"
    path.write_text(path.read_text("utf-8").replace("unit: rad/s", "unit: rpm"), "utf-8")
    assert run_command(folder, *COMMAND, "--out", "found") == 0
    verdict = json.loads((folder / "found" / "verdict.json").read_text("utf-8"))
    jsonschema.validate(verdict, SCHEMA)
    assert (verdict["verdict"], verdict["effects"], verdict["candidates"]) == ("unknown", [], [])
    assert any("taken for rpm" in message for message in verdict["messages"])
    assert "not usable" in capsys.readouterr().out
    page = (folder / "found" / "report.html").read_text("utf-8")
    assert "not usable" in page and "taken for rpm" in page
    assert run_command(folder, "check", "found/variant.yaml") == 0


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--budget", "soon"], 2, "is not a time"),
        (["--fail-on", "doubt"], 2, "one of effect"),
        (["--effects", "spec/none"], 1, "there is no effect in"),
        (["--held-out", "./run_0.csv"], 2, "cannot be held out"),
        (["--held-out", "run_9.csv"], 1, "run_9.csv cannot be held out: there is no such file"),
        (["--train", "./run_1.csv"], 2, "is named twice"),
    ],
)
def test_what_is_asked_for_wrongly_is_told(
    words: list[str], code: int, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_project(tmp_path / "project")
    (folder / "spec" / "none").mkdir()
    assert run_command(folder, *COMMAND, "--out", "found", *words) == code
    assert told in capsys.readouterr().err
    assert not list((folder / "found").glob("*"))
