"""Tables: interpolation against numpy, at their points, outside, at NaN; units of both."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from engine.interpreter.interpreter import Interpreter
from language.numerics.interpolation import Interpolation
from tests.language.spec_builders import automaton, problem_lines, program

SPEC = """language: 1
automaton: derating
period: 1 ms
numbers: float64
parameters:
  lim: {table: {over: temp, unit: kW, points: {60 degC: 2, 90: 1, 393.15 K: 0}}, tunable: true}
inputs: {temp: {unit: degC}}
equations: {P: "lookup(lim, temp)"}
modes: {only: {}}
outputs: [P, mode]
"""
TABLES = Interpolation(float)
lookup, lookup2 = TABLES.lookup, TABLES.lookup2
AXIS = st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=9, unique=True).map(sorted)


@given(AXIS, st.data())
def test_lookup_is_linear_between_its_points_and_held_outside(
    axis: list[float], data: st.DataObject
) -> None:
    values = [data.draw(st.floats(-1e3, 1e3)) for _ in axis]
    x = data.draw(st.one_of(st.floats(-2e6, 2e6), st.sampled_from(axis)))
    found = lookup(axis, len(axis), values, x)
    assert found == pytest.approx(float(np.interp(x, axis, values)), abs=1e-6, rel=1e-9)
    if x in axis:
        assert found == values[axis.index(x)]
    if not axis[0] <= x <= axis[-1]:
        assert found == values[0 if x < axis[0] else -1]


@given(AXIS, AXIS, st.floats(-2e6, 2e6), st.floats(-2e6, 2e6))
def test_a_table_over_two_axes_reproduces_a_plane(
    rows: list[float], columns: list[float], x: float, y: float
) -> None:
    values = [2.0 * a - 3.0 * b for a in rows for b in columns]
    held = (min(max(x, rows[0]), rows[-1]), min(max(y, columns[0]), columns[-1]))
    found = lookup2(rows, columns, len(rows), len(columns), values, x, y)
    assert found == pytest.approx(2.0 * held[0] - 3.0 * held[1], abs=1e-5, rel=1e-9)


def test_nan_comes_out_as_nan() -> None:
    assert math.isnan(lookup((0.0, 1.0), 2, (3.0, 3.0), math.nan))
    for x, y in ((math.nan, 0.5), (0.5, math.nan), (2.0, math.nan), (math.nan, 2.0)):
        found = lookup2((0.0, 1.0), (0.0, 1.0), 2, 2, (3.0, 3.0, 3.0, 3.0), x, y)
        assert math.isnan(found)


@pytest.mark.parametrize(
    ("celsius", "watts"),
    [(0.0, 2000.0), (60.0, 2000.0), (75.0, 1500.0), (105.0, 500.0), (200.0, 0)],
)
def test_axes_and_values_convert_to_si(celsius: float, watts: float) -> None:
    stepper = Interpreter(program(SPEC))
    stepper.set("input.temp", celsius + 273.15)
    stepper.run("step")
    assert stepper.get("equation.P") == pytest.approx(watts)


def test_a_tunable_table_is_an_array_of_calibrations_with_fixed_axes() -> None:
    constants = {constant.name: constant for constant in program(SPEC).constants}
    assert constants["calibration.lim"].items == (2000.0, 1000.0, 0.0)
    assert constants["calibration.lim"].kind == "tunable"
    assert constants["axis.lim_1"].items == (333.15, 363.15, 393.15)
    assert constants["axis.lim_1"].kind == "fixed"


def test_a_scenario_does_not_set_a_table_by_one_value() -> None:
    label = "this parameter is a table: its values are `{points: {...}}`"
    assert problem_lines(lambda: automaton(SPEC, lim="3 kW")) == [f"1:1 {label}"]


def test_points_that_are_one_in_float32_are_refused() -> None:
    near = SPEC.replace("90: 1", "60.0000001: 1")
    assert problem_lines(lambda: program(near)) == []
    single = near.replace("float64", "float32")
    assert problem_lines(lambda: program(single)) == [
        "6:3 two points of the axis `temp` are one in float32"
    ]
