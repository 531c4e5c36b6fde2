"""Values of parameters in their declared units, and values of formulas of a model."""

import math
from pathlib import Path

import pytest

from diagnosis.model.parameter import declared_value, format_value
from language.loading.load import load_automaton
from language.model.automaton import Automaton
from language.overlays.expand_document import Project

SPEC = """
language: 1
automaton: valve
about: a valve
step: 1 ms
parameters:
  k: {value: 37.1 N*m/bar, range: [24.12, 55.65]}
  T: {value: 20 degC, range: [0, 40]}
  i_g: {value: 2, range: [1, 3]}
  J_0: {value: 4 kg*m^2}
  w_0: {value: 60 rpm}
inputs: {p: {unit: bar}}
states: {w: {unit: rad/s, initial: 0 rad/s}}
equations: {J: 0.5 * J_0 * (1 + w / w_0)}
flow: {w: J * der(w) = k * p}
outputs: [w]
"""


@pytest.fixture
def valve(tmp_path: Path) -> Automaton:
    """An automaton with parameters in units that are not those of SI."""
    path = tmp_path / "valve.yaml"
    path.write_text(SPEC, encoding="utf-8")
    return load_automaton(str(path), Project(tmp_path))


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("k", 37.1e-5, "37.1 N*m/bar"),
        ("k", 40.1234567e-5, "40.1235 N*m/bar"),
        ("T", 298.15, "25 degC"),
        ("i_g", 2.5, "2.5"),
    ],
)
def test_a_value_has_its_declared_unit(
    valve: Automaton, name: str, value: float, text: str
) -> None:
    assert format_value(value, valve.parameters[name]) == text


def test_a_value_stays_in_its_range(valve: Automaton) -> None:
    above = 55.65e-5 * (1.0 + 1e-9)
    written, unit = format_value(above, valve.parameters["k"]).split()
    assert float(written) <= 55.65
    assert unit == "N*m/bar"


def test_a_coefficient_may_depend_on_equations_and_states(valve: Automaton) -> None:
    assert declared_value(valve, "J_0 / 2") == 2.0
    assert declared_value(valve, "J") is None
    at_speed = {"w": 2.0 * math.pi * 3.0, "p": math.nan}
    assert declared_value(valve, "J", at_speed) == pytest.approx(8.0)
    assert declared_value(valve, "J * p", at_speed) is None
    assert declared_value(valve, "unknown", at_speed) is None
