"""Temperatures in degC are points; widths and differences of a study are in K."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from language.overlays.expand_document import Project, read_document
from language.text.diagnostic import SpecError
from sweep.analysis.plots import draw_pictures
from sweep.analysis.summary import summary_of
from sweep.definition.measure import SignalMeasure
from sweep.definition.study import Axis, Distribution
from sweep.definition.study_reader import read_study
from sweep.execution.study_run import run_study
from tests.sweep.example_studies import QUICK_EXECUTOR, STUDIES, make_study

POINT = "a temperature in degC is a point, not a difference"


def test_points_have_their_zero_and_widths_have_none() -> None:
    made = make_study("warm")
    courses = {varied.name: varied.distribution for varied in made.variables}
    assert courses["oven.T_a"] == Distribution("normal", (273.15, 5.0), (263.15, 283.15))
    assert courses["s.noise.sd"] == Axis((0.1, 0.2))
    assert courses["inputs.draught.chirp.amplitude"] == Distribution("uniform", (1.0, 2.0))
    calm = made.measures[1]
    assert isinstance(calm, SignalMeasure) and calm.within == 1.0


def test_a_bare_width_is_in_the_unit_of_the_parameter_without_its_zero() -> None:
    course = make_study("warm", ("[0 degC, 5 K]", "[0, 5]")).variables[1].distribution
    assert course == Distribution("normal", (273.15, 5.0), (263.15, 283.15))


SD, DRAWN = "[0.1, 0.2 K]", "{uniform: [1 K, 2 K]}"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[0 degC, 5 K]", "[0 degC, 5 degC]"),
        ("within: 1 K", "within: 1 degC"),
        (SD, "[0.1, 0.2 degC]"),
        (DRAWN, "{uniform: [1 K, 2 degC]}"),
        (DRAWN, "{normal: [1 K, 2 K], within: [0.5 degC, 300 K]}"),
        ("sampling:", "  c: [1, 2]\nset: {oven.G: c * 1 W/K, s.quantise: 1 degC}\nsampling:"),
    ],
)
def test_a_width_in_degrees_celsius_is_refused(old: str, new: str) -> None:
    with pytest.raises(SpecError) as caught:
        make_study("warm", (old, new))
    (problem,) = [each for each in caught.value.problems if each.severity == "error"]
    assert (problem.kind, problem.label) == ("dimension", POINT)
    assert problem.help == "write a difference in K"


def test_groups_and_axes_are_in_the_units_of_the_parameters(tmp_path: Path) -> None:
    plots = "plots: {map: {heat_map: last, over: [oven.C, oven.T_a]}}\nsummary:"
    store = run_study(make_study("warm", ("summary:", plots)), tmp_path, QUICK_EXECUTOR).store
    lines = summary_of(store).lines
    assert [line.group["oven.C"] for line in lines[:2]] == ["4 kJ/K", "5 kJ/K"]
    axis = draw_pictures(store)["map"].figure.axes[0]
    assert [text.get_text() for text in axis.get_xticklabels()] == ["4", "5"]
    assert axis.get_xlabel() == "oven.C [kJ/K]"
    assert axis.get_ylabel() == "oven.T_a, temperature [degC]"
    assert all(-10 <= float(text.get_text()) <= 10 for text in axis.get_yticklabels())


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("kitchen", "sd: 0.1 K", "sd: 0.1 degC"),
        ("kitchen", "quantise: 0.5", "quantise: 0.5 degC"),
        ("cooling", "amplitude: 1 K", "amplitude: 1 degC"),
    ],
)
def test_so_are_widths_of_sensors_and_chirps(file: str, old: str, new: str, tmp_path: Path) -> None:
    folder = tmp_path / "spec"
    shutil.copytree(STUDIES / "spec", folder)
    path = folder / f"{file}.yaml"
    path.write_text(path.read_text().replace(old, new))
    project = Project(tmp_path)
    with pytest.raises(SpecError, match=POINT):
        read_study(read_document(folder / "study_warm.yaml"), project)
