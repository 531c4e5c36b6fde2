"""Explaining: a spec with the places of its values; the difference of two."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from language.ir.printer import digest
from language.loading.load import load_automaton, program_of
from language.overlays.expand_document import Project
from modewright.api.pass_output import compare_specs, explain_spec, spec_differences_json, spec_json
from modewright.cli.app import app
from tests.language.spec_builders import ROOT, SHIPPED, project_of

CALM = """language: 1
variant: calm
extends: driveline
parameters: {J_em: {value: 0.06 kg*m^2}}
effects:
  tyre_slip@vehicle: {values: {C_t: 50 kN*m}}
"""
WILD = "language: 1\nvariant: wild\nextends: calm\nparameters: {J_em: {value: 0.07 kg*m^2}}\n"


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Project:
    monkeypatch.chdir(tmp_path)
    return project_of(tmp_path, calm=CALM, wild=WILD)


def values(spec: str) -> dict[str, dict[str, Any]]:
    return {row["path"]: row for row in spec_json(spec)["values"]}


@pytest.mark.parametrize("name", ["driveline", "estimator", "estimator_simple", "driveline_load"])
def test_what_is_printed_can_be_read_again(name: str, tmp_path: Path) -> None:
    printed = explain_spec(name, "document", {}, ROOT)
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "again.yaml").write_text(printed, "utf-8")
    again = program_of(load_automaton(name, Project(tmp_path)))
    assert digest(again) == digest(program_of(load_automaton(name, SHIPPED)))


def test_every_value_says_its_file_line_and_layer(project: Project) -> None:
    found = values("wild")
    inertia = found["parameters.J_em.value"]
    assert (inertia["value"], inertia["place"], inertia["layer"]) == (
        "0.07 kg*m^2",
        "spec/wild.yaml:4",
        "variant wild",
    )
    given = found["parameters.C_t_vehicle.value"]
    assert (given["value"], given["place"], given["layer"]) == (
        "50 kN*m",
        "spec/calm.yaml:6",
        "variant calm",
    )
    assert found["parameters.R.value"]["layer"] == "automaton driveline"
    assert found["parameters.l_r_vehicle.value"]["layer"] == "effect tyre_slip@vehicle"
    assert str(found["parameters.l_r_vehicle.value"]["place"]).endswith("tyre_slip.yaml:8")


def test_a_rewritten_value_says_by_what(project: Project) -> None:
    row = values("calm")["equations.T_aer"]
    assert (row["value"], row["layer"]) == ("a_aer * r_w^3 * w_v_vehicle^2", "automaton driveline")
    (change,) = row["changes"]
    assert change["layer"] == "effect tyre_slip@vehicle"
    assert change["place"].endswith("tyre_slip.yaml:16")


def test_the_difference_of_two_is_by_key_path(project: Project) -> None:
    found = {d["path"]: d for d in spec_differences_json("calm", "wild")["differences"]}
    assert set(found) == {"automaton", "parameters.J_em.value"}
    assert found["parameters.J_em.value"]["old"]["value"] == "0.06 kg*m^2"
    text = compare_specs("calm", "wild", "document", {})
    assert "- parameters.J_em.value: 0.06 kg*m^2" in text
    assert "# spec/wild.yaml:4 (variant wild)" in text
    assert compare_specs("calm", "calm", "document", {}) == ""


def test_what_one_of_two_has_is_told(project: Project) -> None:
    found = {d["path"]: d for d in spec_differences_json("driveline", "calm")["differences"]}
    assert found["terms.w_w.tyre_vehicle"]["old"] is None
    assert found["terms.w_w.tyre_vehicle"]["new"]["value"] == "-T_t_vehicle"


def test_the_later_passes_are_printed_and_compared(project: Project) -> None:
    model = explain_spec("calm", "model", {})
    assert "initial: w_w" in model
    assert "value: 50000" in model
    assert explain_spec("calm", "program", {}).startswith("program calm\n")
    text = compare_specs("calm", "wild", "model", {})
    assert "-      value: 0.06" in text and "+      value: 0.07" in text
    text = compare_specs("calm", "wild", "program", {})
    assert "+calibration.J_em = 0.07" in text


def test_a_system_a_scenario_and_a_map_are_explained() -> None:
    for name in ("ev_driveline", "tip_out", "reference_trace"):
        assert "(" in explain_spec(name, "document", {}, ROOT)


def test_the_command_prints_one_or_two(
    project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    app(["explain", "calm", "--json"], standalone_mode=False)
    assert json.loads(capsys.readouterr().out)["name"] == "calm"
    app(["explain", "calm", "wild", "--json"], standalone_mode=False)
    assert len(json.loads(capsys.readouterr().out)["differences"]) == 2
    app(["explain", "calm", "wild"], standalone_mode=False)
    assert len(capsys.readouterr().out.splitlines()) == 4
    app(["explain", "calm", "--pass", "program"], standalone_mode=False)
    assert capsys.readouterr().out.startswith("program calm")


def test_the_numbers_of_a_run_and_its_observers_are_printed() -> None:
    """K of a run, |A h|, its work; Phi, Gamma and L of an observer, as they stand in the C."""
    text = explain_spec("estimator", "numbers", {}, ROOT)
    assert "method exponential, step 0.001 s, K = " in text
    assert "mode no_contact: |A h| = 2.9" in text
    assert "work: at most 4 events per substep, " in text
    made = program_of(load_automaton("estimator", SHIPPED))
    for constant in made.constants:
        shown = ("drive_Phi.", "drive_Gamma.", "drive_L.")
        if constant.name.removeprefix("solved.").startswith(shown):
            assert f"{constant.value:.16g}" in text.partition("observer of mode coast")[0]


def test_what_a_rewind_does_at_most_is_printed() -> None:
    """3 ticks back: one look at each and now, one at the end of a step, 24 halvings."""
    text = explain_spec("hko", "numbers", {}, ROOT)
    assert "rewind drive -> gap: at most 29 evaluations of `until` and 3 runs" in text
    assert "longest tick: at most 31570 operations" in text
    assert "transition 1 gap: 1 -> 0 rewind 3 ticks" in explain_spec("hko", "program", {}, ROOT)


def test_the_largest_stable_step_is_printed_where_it_holds(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    assert app(["check", "driveline"], standalone_mode=False) in (None, 0)
    out = capsys.readouterr().out
    assert "driveline: method rk4, step 0.00025 s" in out
    assert "mode no_contact: largest stable step 0.0081237" in out
    assert "of `k_hs / c_hs * (theta_d - theta_b)` in the rate of theta_b" in out
