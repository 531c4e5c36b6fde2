"""Calibrations: values apart from structure, laid last, with their provenance."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw
from language.loading.load import load_automaton
from language.loading.system_reader import read_system
from language.overlays.expand_document import Project, read_document
from modewright.api import pass_output as explaining
from tests.language.spec_builders import problem_lines, project_of

FIT = """language: 1
calibration: fit
of: {of}
from: tip-out on the rig
date: 2026-11-20
parameters:
  J_em: {{value: 0.061 kg*m^2, std: 0.002 kg*m^2, from: run-up}}
  k_hs: 5.2 kN*m/rad
"""
BETTER = """language: 1
variant: better
extends: {base}
{body}calibrations: [fit]
"""


def fitted(folder: Path, base: str, body: str = "", of: str = "driveline") -> Project:
    return project_of(folder, fit=FIT.format(of=of), better=BETTER.format(base=base, body=body))


def value(project: Project, name: str, parameter: str) -> float:
    return float(load_automaton(name, project).parameters[parameter].value or 0)


def test_a_variant_takes_values_from_a_calibration_last(tmp_path: Path) -> None:
    project = fitted(tmp_path, "driveline", "parameters: {J_em: {value: 0.07 kg*m^2}}\n")
    assert value(project, "better", "J_em") == 0.061
    assert value(project, "better", "k_hs") == 5200
    assert load_automaton("better", project).parameters["J_em"].kind == "tunable"
    assert mw.check("better", tmp_path) == [] == mw.check("fit", tmp_path)


def test_a_calibration_reaches_what_an_effect_brings(tmp_path: Path) -> None:
    body = "effects: {coulomb_friction@w_em: {}}\n"
    project = fitted(tmp_path, "driveline", body)
    more = FIT.format(of="better").replace("k_hs: 5.2 kN*m/rad", "T_c_w_em: 2 N*m")
    project_of(tmp_path, more=more.replace("calibration: fit", "calibration: more"))
    project_of(tmp_path, best="language: 1\nvariant: best\nextends: better\ncalibrations: [more]\n")
    assert value(Project(tmp_path), "best", "T_c_w_em") == 2
    assert value(project, "best", "k_hs") == 5200


def test_an_estimator_takes_a_calibration_of_its_model(tmp_path: Path) -> None:
    project = fitted(tmp_path, "estimator")
    automaton = load_automaton("better", project)
    assert automaton.model is not None
    assert float(automaton.model.parameters["J_em"].value or 0) == 0.061


@pytest.mark.parametrize("of", ["driveline", "ev_driveline"])
def test_a_system_gives_it_to_the_instances_that_it_is_of(tmp_path: Path, of: str) -> None:
    project = fitted(tmp_path, "ev_driveline", of=of)
    if of == "ev_driveline":
        text = FIT.format(of=of).replace("J_em:", "plant.J_em:").replace("k_hs:", "plant.k_hs:")
        project_of(tmp_path, fit=text)
    system = read_system(read_document(project.path_of("better")), project)
    inertia = {n: i.automaton.parameters["J_em"].value for n, i in system.instances.items()}
    assert {n: float(v or 0) for n, v in inertia.items()} == {
        "plant": 0.061,
        "est": 0.05,
        "simple": 0.05,
    }


def test_an_option_of_a_command_calibrates(tmp_path: Path) -> None:
    fitted(tmp_path, "driveline")
    loaded = mw.load("ev_driveline", "tip_out", None, tmp_path, ["fit"])
    parameters = loaded.system.instances["plant"].automaton.parameters
    assert float(parameters["k_hs"].value or 0) == 5200
    files = mw.generate("estimator", None, tmp_path, ["fit"])
    assert any("5200" in text for text in files.values())


def test_a_value_given_by_name_goes_before_a_calibration(tmp_path: Path) -> None:
    fitted(tmp_path, "driveline")
    loaded = mw.load("ev_driveline", "tip_out", {"plant.k_hs": "6 kN*m/rad"}, tmp_path, ["fit"])
    parameters = loaded.system.instances["plant"].automaton.parameters
    assert float(parameters["k_hs"].value or 0) == 6000


def test_a_calibrated_value_says_its_file_and_line(tmp_path: Path) -> None:
    fitted(tmp_path, "driveline")
    found = {row["path"]: row for row in explaining.spec_json("better", tmp_path)["values"]}
    row = found["parameters.k_hs.value"]
    assert (row["value"], row["layer"]) == ("5.2 kN*m/rad", "calibration fit")
    assert str(row["place"]).endswith("fit.yaml:8")


def test_what_is_tunable_and_what_is_compiled_in_is_told(tmp_path: Path) -> None:
    fitted(tmp_path, "driveline")
    lines = explaining.explain_spec("fit", "model", {}, tmp_path).splitlines()
    assert lines == [
        "J_em = 0.061 kg*m^2  # tunable, std 0.002 kg*m^2, run-up, 2026-11-20",
        "k_hs = 5.2 kN*m/rad  # fixed, tip-out on the rig, 2026-11-20",
    ]


def test_a_calibration_of_something_else_is_refused(tmp_path: Path) -> None:
    project = fitted(tmp_path, "driveline", of="estimator")
    assert problem_lines(lambda: load_automaton("better", project)) == [
        "4:16 calibration `fit` is of `estimator`, not of `better`"
    ]


def test_a_bare_number_is_in_the_unit_of_the_parameter(tmp_path: Path) -> None:
    project = fitted(tmp_path, "driveline")
    text = FIT.format(of="driveline").replace("5.2 kN*m/rad", "5200")
    project_of(tmp_path, fit=text)
    assert value(project, "better", "k_hs") == 5200


LIMITED = """language: 1
automaton: limited
period: 10 ms
numbers: float64
parameters:
  one: {value: 2}
  lim:
    tunable: true
    range: [0, 50]
    table: {over: T, unit: N*m, points: {20 degC: 40, 90 degC: 5}}
  map:
    table:
      over: [T, w]
      points: {20 degC: {0 rad/s: 1, 9 rad/s: 2}, 90 degC: {0 rad/s: 3, 9 rad/s: 4}}
inputs: {T: {unit: degC, range: [-40, 150]}, w: {unit: rad/s, range: [0, 9]}}
equations: {most: "lookup(lim, T)", share: "one * lookup(map, T, w)"}
modes: {run: {}}
outputs: [most, share]
"""
RIG = """language: 1
system: rig
inputs: {T: {unit: degC}}
instances: {a: {of: limited}, b: {of: limited, values: {lim: {points: {90 degC: 6}}}}}
connections: {a.T: T, b.T: T, a.w: 0 rad/s, b.w: 0 rad/s}
"""


def tabled(folder: Path, parameters: str) -> Project:
    head = "language: 1\ncalibration: tables\nof: limited\nparameters:\n"
    warm = "language: 1\nvariant: warm\nextends: limited\ncalibrations: [tables]\n"
    return project_of(folder, limited=LIMITED, tables=head + parameters, warm=warm, rig=RIG)


def items(project: Project, name: str, parameter: str) -> list[float]:
    table = load_automaton(name, project).parameters[parameter].table
    assert table
    return [float(value) for value in table.values]


def test_a_calibration_has_values_at_points_of_a_table(tmp_path: Path) -> None:
    """However a point is written; those that are not named stay."""
    rows = "{90 degC: {9 rad/s: 8}, 20 degC: {0 rad/s: -1, 9 rad/s: -2}}"
    lim = "{points: {363.15 K: 0.004 kN*m}}"
    project = tabled(tmp_path, f"  lim: {lim}\n  map: {{points: {rows}}}\n")
    assert items(project, "warm", "lim") == [40, 4]
    assert items(project, "warm", "map") == [-1, -2, 3, 8]
    assert load_automaton("warm", project).parameters["lim"].kind == "tunable"
    assert explaining.explain_spec("tables", "model", {}, tmp_path).splitlines() == [
        f"lim = {lim}  # tunable",
        f"map = {{points: {rows}}}  # fixed",
    ]
    assert mw.check("tables", tmp_path) == [] == mw.check("warm", tmp_path)


def test_instances_have_values_at_points_of_their_own(tmp_path: Path) -> None:
    project = tabled(tmp_path, "  lim: {points: {20 degC: 30}}\n")
    plain = read_system(read_document(project.path_of("rig")), project).instances
    found = {name: one.automaton.parameters["lim"].table for name, one in plain.items()}
    assert {name: [float(v) for v in table.values] for name, table in found.items() if table} == {
        "a": [40, 5],
        "b": [40, 6],
    }


def test_points_of_several_calibrations_add_up(tmp_path: Path) -> None:
    """In a system too, and with the values of its instances."""
    tabled(tmp_path, "  lim: {points: {20 degC: 30}}\n")
    head = "language: 1\ncalibration: {0}\nof: {1}\nparameters: {{{2}}}\n"
    again = head.format("again", "limited", "lim: {points: {363.15 K: 7}}")
    of_rig = head.format("of_rig", "rig", "b.lim: {points: {20 degC: 31}}")
    warm = "language: 1\nvariant: warm\nextends: limited\ncalibrations: [tables, again]\n"
    hot = "language: 1\nvariant: hot\nextends: rig\ncalibrations: [tables, again, of_rig]\n"
    project = project_of(tmp_path, again=again, of_rig=of_rig, warm=warm, hot=hot)
    assert items(project, "warm", "lim") == [30, 7]
    hot_rig = read_system(read_document(project.path_of("hot")), project).instances
    found = [hot_rig[name].automaton.parameters["lim"].table for name in "ab"]
    assert [[float(v) for v in table.values] for table in found if table] == [[30, 7], [31, 7]]


def test_a_calibration_reaches_the_instances_of_an_automaton(tmp_path: Path) -> None:
    tabled(tmp_path, "  lim: {points: {20 degC: 30}}\n")
    host = """language: 1
automaton: host
period: 10 ms
numbers: float64
inputs: {T: {unit: degC, range: [-40, 150]}}
instances: {k1: {of: limited, inputs: {T: T, w: 1 rad/s}}}
modes: {run: {}}
equations: {most: k1.most}
outputs: [most]
"""
    inner = "language: 1\ncalibration: inner\nof: host\n"
    inner += "parameters: {k1_lim: {points: {90 degC: 9}}}\n"
    laid = "language: 1\nvariant: laid\nextends: host\ncalibrations: [inner]\n"
    project = project_of(tmp_path, host=host, inner=inner, laid=laid)
    assert items(project, "laid", "k1_lim") == [40, 9]
    pair = "language: 1\nsystem: pair\ninputs: {T: {unit: degC}}\ninstances: {h: {of: host}}\n"
    pair += "connections: {h.T: T}\ncalibrations: [inner]\n"
    project = project_of(tmp_path, pair=pair)
    made = read_system(read_document(project.path_of("pair")), project).instances["h"].automaton
    assert (
        made.parameters["k1_lim"].table
        == load_automaton("laid", project).parameters["k1_lim"].table
    )
    wrong = inner.replace("k1_lim", "k1_lin")
    project = project_of(tmp_path, inner=wrong)
    (line,) = problem_lines(lambda: load_automaton("laid", project))
    assert line.endswith("`host` has no parameter `k1_lin`")


@pytest.mark.parametrize(
    ("parameters", "label"),
    [
        ("  lim: {points: {50 degC: 3}}", "the table has no point `50 degC`"),
        ("  lim: {points: {90 rad: 3}}", "the table has no point `90 rad`"),
        ("  lim: {points: {90: 3}}", "the table has no point `90`"),
        ("  map: {points: {90 degC: {9: 3}}}", "the table has no point `9`"),
        ("  lim: {points: {90 degC: 3, 363.15 K: 4}}", "`363.15 K` is the point `90 degC` again"),
        ("  lim: {points: {}}", "the values of a table are `{points: {...}}`"),
        ("  lim: 4 N*m", "this parameter is a table: its values are `{points: {...}}`"),
        ("  lim: {points: {90 degC: 3 s}}", "`s` does not fit the unit `N*m`"),
        ("  lim: {points: {90 degC: 51}}", "this value is outside the range"),
        ("  lim: {points: {90 degC: {0: 1}}}", "at `90 degC` the table has a value"),
        ("  map: {points: {90 degC: 3}}", "at `90 degC` the table has a row of values"),
        ("  lim: {points: 3}", "the values of a table are `{points: {...}}`"),
        ("  lim: {points: {90 degC: 3}, std: 1 N*m}", "a table has `points`, no `std`"),
        ("  one: {points: {90 degC: 3}}", "this parameter has no table"),
    ],
)  # fmt: skip
def test_what_is_no_value_at_a_point(tmp_path: Path, parameters: str, label: str) -> None:
    project = tabled(tmp_path, parameters + "\n")
    (line,) = problem_lines(lambda: load_automaton("warm", project))
    assert line.endswith(label)
