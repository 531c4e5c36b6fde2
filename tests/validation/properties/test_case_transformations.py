"""Transformations change how a case is written, not what it says."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from language.expressions.units import parse_unit
from language.loading.load import automaton_of
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, read_document
from tests.validation.properties.case_transformations import (
    TRANSFORMATIONS,
    NotWritableError,
    read_table,
    unit_factor,
)
from tests.validation.properties.invariance import UNCHANGED, difference

SPEC = """\
language: 1
automaton: cart
about: a cart on a rail, 3 m long
step: 2 ms
parameters:
  M: {value: 2.5 kg, range: [1, 4]}
  b: {value: 0.5 N*s/m}
  F_0: {value: 0.2 N, range: [0.1 N, 0.3 N]}
inputs: {F: {unit: N}, active: {unit: 1}}
states: {v: {unit: m/s, initial: 0.1 m/s}}
flow: {v: "M * der(v) = F * active - b * v - F_0 * tanh(v / 0.01 m/s)"}
modes: {moving: {}}
outputs: [v]
"""
MAP = """\
language: 1
map: cart_columns
time: {column: t, unit: s}
columns:
  force: {to: F, unit: N, hold: linear}
  active: {to: active, unit: 1}
  speed: {compare: v, unit: mm/s, delay: 4 ms}
"""
ROWS = [[f"{k / 500:.3f}", f"{0.25 * k:g}", str(k % 2), f"{(k - 8) ** 2}"] for k in range(20)]
BY_NAME = {one.name: one for one in TRANSFORMATIONS}


@pytest.fixture
def case(tmp_path: Path) -> Path:
    (tmp_path / "train").mkdir()
    (tmp_path / "spec.yaml").write_text(SPEC, "utf-8")
    (tmp_path / "map.yaml").write_text(MAP, "utf-8")
    for name in ("a", "b"):
        text = "\n".join(",".join(row) for row in [["t", "force", "active", "speed"], *ROWS])
        (tmp_path / "train" / f"{name}.csv").write_text(text + "\n", "utf-8")
    return tmp_path


def model_of(case: Path) -> Automaton:
    return automaton_of(read_document(case / "spec.yaml"), Project(Path()))


def si_columns(case: Path) -> dict[str, np.ndarray]:
    """The signals of the first recording in SI, NaN where they are not known."""
    mapping = read_map(read_document(case / "map.yaml"), Project(Path()))
    head, *rows = read_table(min((case / "train").glob("*.csv")))
    found = {}
    for name, one in mapping.columns.items():
        column = [row[head.index(name)] for row in rows]
        factor = float(one.unit.factor * one.scale[0])
        found[name] = np.array([float(cell) * factor if cell else math.nan for cell in column])
    times = [float(row[head.index(mapping.time)]) for row in rows]
    return {**found, "time": np.array(times) * float(mapping.time_unit.factor)}


@pytest.mark.parametrize("name", [one.name for one in TRANSFORMATIONS if one.name[:4] != "blas"])
def test_a_transformed_spec_has_the_values_in_si_times_the_factors(name: str, case: Path) -> None:
    before, one = model_of(case), BY_NAME[name]
    one.change(case)
    after = model_of(case)
    assert before.parameters.keys() == after.parameters.keys()
    for key, parameter in before.parameters.items():
        other = after.parameters[key]
        factor = one.factor_of(parameter.unit.text)
        assert parameter.value is not None and other.value is not None
        assert float(other.value) == pytest.approx(factor * float(parameter.value))
        if parameter.range is not None and other.range is not None:
            for low, high in zip(parameter.range, other.range, strict=True):
                assert float(high) == pytest.approx(factor * float(low))


@pytest.mark.parametrize("name", ["names", "prefixes", "scale_kg", "scale_m", "stretch_s"])
def test_transformed_recordings_have_the_values_in_si_times_the_factors(
    name: str, case: Path
) -> None:
    before, one = si_columns(case), BY_NAME[name]
    one.change(case)
    after = si_columns(case)
    for column, unit in {"force": "N", "active": "1", "speed": "m/s", "time": "s"}.items():
        factor = one.factor_of(unit) if unit != "1" else 1.0
        assert after[column] == pytest.approx(factor * before[column])


def test_a_cut_recording_has_all_rows_and_starts_like_the_whole(case: Path) -> None:
    """The speed is nearest to its first value at the end of the middle half."""
    BY_NAME["cut"].change(case)
    tables = {file.name: read_table(file)[1:] for file in sorted((case / "train").iterdir())}
    assert list(tables) == ["aa.csv", "ab.csv", "b.csv"]
    assert tables["aa.csv"] + tables["ab.csv"] == ROWS
    assert len(tables["aa.csv"]) == 14


def test_finer_samples_follow_the_hold_and_have_no_outputs(case: Path) -> None:
    BY_NAME["finer"].change(case)
    found = si_columns(case)
    assert found["force"][:4] == pytest.approx([0.0, 0.125, 0.25, 0.375])
    assert found["active"][:4].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert np.isnan(found["speed"]).tolist() == [k % 2 == 1 for k in range(39)]
    assert np.diff(found["time"]) == pytest.approx(0.001)


def test_an_input_of_unknown_hold_has_no_finer_samples(case: Path) -> None:
    text = (case / "map.yaml").read_text().replace(", hold: linear", "")
    (case / "map.yaml").write_text(text)
    with pytest.raises(NotWritableError):
        BY_NAME["finer"].change(case)


@pytest.mark.parametrize("unit", ["N*m", "kg*m^2", "W/K", "ohm", "rad/s"])
def test_the_factor_of_a_unit_is_that_of_its_base_units(unit: str) -> None:
    powers = parse_unit(unit).dimension.powers
    assert float(unit_factor(unit, {"m": 10, "s": 100})) == pytest.approx(
        10.0 ** (powers[0] + 2 * powers[2])
    )


def test_decisions_differ_by_outcome_effect_place_or_parameters() -> None:
    effect = {"name": "backlash", "place": "elements.belt"}
    before = {"outcome": "effect", "effects": [effect], "parameters": {"k": [2.0, 0.1, "N/m"]}}
    assert difference(before, before, UNCHANGED) == ""
    assert difference(before, {**before, "outcome": "ambiguous"}, UNCHANGED) == "outcome"
    other = {**before, "effects": [{**effect, "place": "flow.v"}]}
    assert difference(before, other, UNCHANGED) == "place"
    moved = {**before, "parameters": {"k": [2.3, 0.1, "N/m"]}}
    assert difference(before, moved, UNCHANGED) == "k 3.0 std"
    scaled = {**before, "parameters": {"k": [2000.0, 100.0, "N/m"]}}
    assert difference(before, scaled, BY_NAME["scale_kg"]) == ""
