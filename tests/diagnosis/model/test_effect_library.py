"""Effects as a reader sees them: listed, explained, with their places, drawn as they show."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from diagnosis.model.effect_library import describe_effect, library_effects
from diagnosis.model.effect_signature import simulate_signature
from language.overlays.expand_document import expand_document, read_document
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.diagnosis.rotor_project import MAP, SPEC
from tests.language.spec_builders import ROOT, SHIPPED, document, project_of

HOUSE_EFFECT = """language: 1
effect: windage
about: drag of the cooling fan
at: {balance: {of: rate}}
parameters: {c_w: {value: 1, unit: $drag_unit, range: [0, 10], neutral: 0}}
terms: {$x: {windage: -c_w * $x * abs($x)}}
"""


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))


def test_every_effect_that_is_shipped_is_listed_in_a_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    assert run("effects", "--json") == 0
    found = json.loads(capsys.readouterr().out)["effects"]
    files = {path.stem for path in (ROOT / "spec" / "effects").glob("*.yaml")}
    assert {one["id"] for one in found} == files
    assert all(one["about"] and one["fits"] for one in found)


def test_an_effect_of_the_project_is_one_of_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    project_of(tmp_path, spinner=SPEC, bench_columns=MAP, windage=HOUSE_EFFECT)
    monkeypatch.chdir(tmp_path)
    assert run("effects", "windage", "--at", "spinner") == 0
    told = capsys.readouterr().out
    assert "in spinner: w\n" in told
    assert "terms: {$x: {windage: -c_w * $x * abs($x)}}" in told
    assert "at:" not in told


def test_what_an_effect_changes_at_a_place_is_told_line_by_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    project_of(tmp_path, spinner=SPEC, bench_columns=MAP)
    monkeypatch.chdir(tmp_path)
    assert run("effects", "torque_gain", "--at", "spinner") == 0
    told = capsys.readouterr().out
    lines = ["applied to T of spinner:", "  flow.w", "    - J * der(w) = T - b * w"]
    lines += ["    + J * der(w) = u_g_T - b * w", "  equations.u_g_T", "    + gain_T * T"]
    assert "\n".join(lines) in told
    assert run("effects", "torque_gain@T", "--at", "spinner", "--json") == 0
    (one,) = json.loads(capsys.readouterr().out)["effects"]
    assert one["places"] == ["inputs.T"]
    added = {"path": "equations.u_g_T", "before": "", "after": "gain_T * T"}
    assert added in one["changes"]["T"]


def test_an_effect_is_found_by_the_name_that_verdicts_use(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    assert run("effects", "second_gap") == 0
    told = capsys.readouterr().out
    assert told.startswith("backlash: ")
    assert "verdicts call it second_gap on an elastic element that has a gap" in told


def test_places_are_those_where_an_effect_can_be_laid() -> None:
    path = SHIPPED.path_of("blind_driveline")
    base = expand_document(read_document(path), SHIPPED)
    wanted = ("coulomb_friction", "torque_gain", "sensor_lag", "position_dependent_stiffness")
    effects = [one for one in library_effects(SHIPPED) if one.name in wanted]
    places = {one.name: describe_effect(one, base, SHIPPED).places for one in effects}
    assert places["coulomb_friction"] == ("w_em", "w_w")  # `w_s` is a filter: no torques there
    assert places["torque_gain"] == ("T_em", "T_br")
    assert places["sensor_lag"] == ("w_em", "w_s")
    assert places["position_dependent_stiffness"] == ("half_shaft",)


def test_a_signature_is_what_the_equation_of_the_effect_says(tmp_path: Path) -> None:
    """J dw/dt = T - b w from rest, and dry friction T_c: w is behind by T_c (1 - e^-bt/J) / b."""
    project = project_of(tmp_path, bench_columns=MAP)
    base = expand_document(document(SPEC), project)
    (friction,) = (one for one in library_effects(SHIPPED) if one.name == "coulomb_friction")
    (layer,) = describe_effect(friction, base, project).placements
    found = simulate_signature(base, project, layer, ("T", "10 N*m"))
    assert found.values == {"T_c": "0.1 N*m", "w_s": "0.01 rad/s"}
    times = found.without_effect.times
    change = found.with_effect.signals["spinner.w"] - found.without_effect.signals["spinner.w"]
    place = int(np.searchsorted(times, 0.95))
    behind = 0.1 * (1.0 - np.exp(-0.1 * times[place] / 0.5)) / 0.1
    assert change[place] == pytest.approx(-behind, abs=0.001)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["tyre_slp"], "did you mean `tyre_slip`?"),
        (["fric"], "there are `coulomb_friction`, `stribeck_friction`, `viscous_friction`"),
        (["second_gp"], "did you mean `second_gap`?"),
        (["windmill"], "`modewright effects` lists them"),
        (["torque_gain@w", "--at", "spinner"], "`torque_gain` fits no `w` of `spinner`"),
        (["torque_gain", "--at", "spinner", "--step", "T=1 N*m"], "say with --plot"),
        (["--plot", "out.png"], "name the effect"),
        (["tyre_slip", "--at", "spinner", "--plot", "out.png"], "fits no place of `spinner`"),
        (["torque_gain", "--at", "spinner", "--plot", "o.png", "--step", "T"], "input=height"),
        (["torque_gain", "--at", "spinner", "--plot", "o.png", "--step", "F=1 N"], "no input `F`"),
    ],
)
def test_what_is_asked_for_wrongly_is_told(
    words: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    project_of(tmp_path, spinner=SPEC, bench_columns=MAP)
    monkeypatch.chdir(tmp_path)
    assert run("effects", *words) in (1, 2)
    assert told in " ".join(capsys.readouterr().err.replace("│", " ").split())


def test_a_picture_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project_of(tmp_path, spinner=SPEC, bench_columns=MAP)
    monkeypatch.chdir(tmp_path)
    assert run("effects", "torque_gain@T", "--at", "spinner", "--plot", "shown.svg") == 0
    assert (tmp_path / "shown.svg").read_bytes().startswith(b"<?xml")


def test_a_map_has_no_places(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    assert run("effects", "--at", "blind_columns") == 1
    assert "`blind_columns` is a map, not an automaton" in capsys.readouterr().err
