"""Scenario: inputs over time, start values and horizon of a system."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from language.expressions.constant_literal import evaluate_literal
from language.expressions.units import parse_unit
from language.loading.scenario_reader import MAX_HORIZON, read_scenario
from language.loading.system_reader import read_system
from language.model.system import Scenario, System
from language.overlays.expand_document import read_document
from tests.language.spec_builders import (
    SHIPPED,
    dimension,
    document,
    problem_lines,
    project_of,
    raised_problems,
    si_value,
    tree,
)

PLANT = """language: 1
automaton: plant
inputs: {u: {unit: m/s}, hot: {unit: degC}, way: {unit: m}}
states:
  x: {unit: m, initial: 0 m}
  phi: {unit: rad, initial: 0 rad}
  Tp: {unit: degC, initial: hot}
flow: {x: der(x) = u, phi: der(phi) = 0, Tp: der(Tp) = 0}
modes: {only: {}}
"""
RIG = """language: 1
system: rig
inputs: {u: {unit: km/h}, hot: {unit: degC, default: 20}, way: {unit: m, default: 1 m}}
instances: {p: {of: plant}}
connections: {p.u: u, p.hot: hot, p.way: way}
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> System:
    folder: Path = tmp_path_factory.mktemp("rig")
    project = project_of(folder, plant=PLANT, rig=RIG)
    return read_system(read_document(project.path_of("rig")), project)


def run(
    system: System,
    inputs: str = "u: 36",
    initial: str = "",
    horizon: str = "2 s",
    more: str = "",
) -> Scenario:
    text = f"language: 1\nscenario: run\nof: rig\nhorizon: {horizon}\n"
    text += f"inputs: {{{inputs}}}\ninitial: {{{initial}}}\n{more}\n"
    return read_scenario(document(text), SHIPPED, system)


def lines(system: System, *parts: str) -> list[str]:
    return [line.partition(" ")[2] for line in problem_lines(lambda: run(system, *parts))]


def steps(made: Scenario, name: str) -> list[tuple[Fraction, Fraction]]:
    return list(made.inputs[name].steps)


def pairs(*found: tuple[int | Fraction, int | Fraction]) -> list[tuple[Fraction, Fraction]]:
    return [(Fraction(time), Fraction(value)) for time, value in found]


# Inputs.


def test_a_value_is_held_from_time_0(system: System) -> None:
    assert steps(run(system, "u: 18 km/h"), "u") == pairs((0, 5))


def test_a_bare_value_is_in_the_unit_of_the_input(system: System) -> None:
    assert steps(run(system, "u: 36"), "u") == pairs((0, 10))
    assert steps(run(system, "u: -36"), "u") == pairs((0, -10))
    assert steps(run(system, "u: 0"), "u") == pairs((0, 0))


def test_an_input_without_a_value_has_its_default(system: System) -> None:
    assert steps(run(system), "way") == pairs((0, 1))
    assert steps(run(system), "hot") == pairs((0, Fraction(29315, 100)))


def test_steps_are_in_order_and_exact(system: System) -> None:
    made = run(system, "u: {start: 0, steps: {0.1 s: 36, 200 ms: -3 m/s, 1 min: 0}}")
    tenth = Fraction(1, 10)
    assert steps(made, "u") == pairs((0, 0), (tenth, 10), (2 * tenth, -3), (60, 0))


@given(times=st.lists(st.integers(1, 999), min_size=1, max_size=5, unique=True))
def test_steps_are_read_in_the_order_of_time_only(system: System, times: list[int]) -> None:
    written = ", ".join(f"{time} ms: {time}" for time in times)
    inputs = f"u: {{start: 0, steps: {{{written}}}}}"
    if times == sorted(times):
        found = steps(run(system, inputs), "u")[1:]
        assert found == [(Fraction(t, 1000), Fraction(t * 1000, 3600)) for t in times]
    else:
        assert "steps are in the order of time" in lines(system, inputs)


def test_a_start_alone_is_a_value(system: System) -> None:
    assert steps(run(system, "u: {start: 72}"), "u") == pairs((0, 20))


def test_degrees_celsius_are_converted(system: System) -> None:
    made = run(system, "u: 0, hot: {start: -10, steps: {1 s: -20 degC, 2 s: 300 K}}")
    assert steps(made, "hot") == pairs(
        (0, Fraction(26315, 100)),
        (1, Fraction(25315, 100)),
        (2, 300),
    )


STEP_TIME = "`the time of a step` is a time above zero, like `2.5 s`"


@pytest.mark.parametrize(
    ("inputs", "label"),
    [
        ("", "input `u` of `rig` has no value in the scenario"),
        ("v: 3", "`v` is not an input of `rig`"),
        ("u: 3 s", "`s` does not fit the unit `km/h`"),
        ("u: 3 + 4", "`u` is a number with a unit, not an expression"),
        ("u: {steps: {1 s: 3}}", "`start` is missing"),
        ("u: {start: 0, stop: 3}", "`stop` is not a key of `inputs.u`"),
        ("u: {start: 0, steps: {1 s: 3, 0.5 s: 4}}", "steps are in the order of time"),
        ("u: {start: 0, steps: {1 s: 3, 1000 ms: 4}}", "steps are in the order of time"),
        ("u: {start: 0, steps: {1: 3}}", STEP_TIME),
        (
            "u: {start: 0, steps: {0 s: 3}}",
            STEP_TIME,
        ),
        (
            "u: {start: 0, steps: {-1 s: 3}}",
            STEP_TIME,
        ),
        (
            "u: {start: 0, steps: {1 m: 3}}",
            STEP_TIME,
        ),
        ("u: {start: 0, steps: {1 s: 3 kg}}", "`kg` does not fit the unit `km/h`"),
        ("u: {start: 0, steps: [1 s]}", "`inputs.u.steps` is a mapping"),
        ("u: [1, 2]", "`inputs.u` is a mapping"),
        ("u: {start: 0, steps: {1 s: 3}, hold: previous}", "`hold` belongs to a `table`"),
        ("u: {start: 0, hold: linear}", "`hold` belongs to a `table`"),
    ],
)
def test_an_input_that_is_wrong_is_refused(system: System, inputs: str, label: str) -> None:
    assert label in lines(system, inputs)


@pytest.mark.parametrize(
    ("inputs", "label"),
    [
        ("u: {start: 0, steps: {-1 s: 3}}", STEP_TIME),
        (
            "u: {start: 0, ramp: {from: 2 s, to: 1 s, value: 3}}",
            "a ramp ends after it begins",
        ),
        ("u: {table: {}}", "a `table` has at least one point"),
    ],
)
def test_a_wrong_time_is_reported_beside_other_problems(
    system: System, inputs: str, label: str
) -> None:
    assert lines(system, f"v: 3, {inputs}") == ["`v` is not an input of `rig`", label]


@pytest.mark.parametrize(
    ("inputs", "label"),
    [
        ("u: {start: 0, steps: {0.5 s: 1, -1 s: 3, 0.8 s: 2}}", STEP_TIME),
        (
            "u: {table: {0.5 s: 1, 1 s + 1 s: 3, 0.8 s: 2}}",
            "`the time of a point` is a number with a unit, not an expression",
        ),
        ("u: {start: 0, ramp: {to: 1 s, value: 3}}", "`from` is missing"),
        ("u: {start: 0, ramp: {from: 1 s, value: 3}}", "`to` is missing"),
    ],
)
def test_a_wrong_time_is_one_problem(system: System, inputs: str, label: str) -> None:
    assert lines(system, inputs) == [label]


def test_the_problem_of_a_step_stands_at_the_step(system: System) -> None:
    text = "u: {start: 0, steps: {1 s: 3, 0.5 s: 4}}"
    (problem,) = raised_problems(lambda: run(system, text))
    line = problem.span.source.lines[problem.span.line - 1]
    assert line[problem.span.column - 1 :].startswith("0.5 s: 4")


# Start values.


def test_a_start_value_is_a_formula_of_literals(system: System) -> None:
    made = run(system, "u: 0", "p.x: 36 km/h * 2 s - 5 m, p.phi: -3 deg")
    assert made.initial == {"p.x": 15, "p.phi": -si_value("3 deg")}


@pytest.mark.parametrize(
    ("initial", "label"),
    [
        ("p.y: 3 m", "`p.y` is not a state of an instance of `rig`"),
        ("x: 3 m", "`x` is not a state of an instance of `rig`"),
        ("q.x: 3 m", "`q.x` is not a state of an instance of `rig`"),
        ("p.x: 3 s", "this is in `s`, the state is in `m`"),
        ("p.x: 3", "this is in `1`, the state is in `m`"),
        ("p.phi: 3", "this is in `1`, the state is in `rad`"),
        ("p.x: 3 m + 1 s", "`+` joins `m` and `s`"),
        ("p.x: 3 m / 0", "this divides by zero"),
        ("p.x: k * 1 m", "this is made of numbers with units only"),
        ("p.x: sqrt(4 m^2)", "this is made of numbers with units only"),
    ],
)
def test_a_start_value_that_is_wrong_is_refused(system: System, initial: str, label: str) -> None:
    assert label in lines(system, "u: 0", initial)


def test_a_start_value_below_zero_celsius_is_converted(system: System) -> None:
    assert run(system, "u: 0", "p.Tp: -10 degC").initial["p.Tp"] == Fraction(26315, 100)


def test_a_zero_with_another_unit_is_refused(system: System) -> None:
    assert lines(system, "u: 0", "p.x: 0 s")


def test_a_bare_0_starts_anything(system: System) -> None:
    assert run(system, "u: 0", "p.x: 0, p.phi: 0").initial == {"p.x": 0, "p.phi": 0}


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("40 km/h / 0.29 m", Fraction(40000, 3600) / Fraction(29, 100), "1/s"),
        ("2 * (3 m - 50 cm)", Fraction(5), "m"),
        ("-(1 m - 2 m) / 4", Fraction(1, 4), "m"),
        ("3 rad * 2 m", Fraction(6), "m"),
    ],
)
def test_a_constant_is_exact_and_has_a_dimension(text: str, value: Fraction, unit: str) -> None:
    found, kind = evaluate_literal(tree(text))
    assert (found, kind.powers) == (value, dimension(unit).powers)


def test_a_sum_with_a_free_value_has_the_angle_of_the_other() -> None:
    for text in ("2 m/s / 1 m + 3 rad/s", "3 rad/s - 2 m/s / 1 m"):
        assert evaluate_literal(tree(text))[1] == dimension("rad/s")


# Times.


def test_horizon_and_record_are_times(system: System) -> None:
    made = run(system, "u: 0", "", "1.5 min", "record: {every: 0.5 ms}")
    assert (made.horizon, made.every) == (Fraction(90), Fraction(1, 2000))
    assert run(system).every == parse_unit("ms").factor


@pytest.mark.parametrize("text", ["0 s", "-1 s", "3", "3 m", "1 s + 1 s"])
@pytest.mark.parametrize("what", ["horizon", "every"])
def test_a_time_that_is_none_is_refused(system: System, what: str, text: str) -> None:
    parts = ("1 s", f"record: {{every: {text}}}") if what == "every" else (text, "")
    (label,) = lines(system, "u: 0", "", *parts)
    assert f"`{what}` is" in label


def test_a_day_is_the_longest_horizon(system: System) -> None:
    assert run(system, horizon="24 h").horizon == MAX_HORIZON
    assert lines(system, "u: 0", "", "24.01 h") == ["the horizon is longer than a day"]


def test_a_scenario_without_a_horizon_is_refused(system: System) -> None:
    text = "language: 1\nscenario: run\nof: rig\ninputs: {u: 0}\n"
    assert problem_lines(lambda: read_scenario(document(text), SHIPPED, system)) == [
        "2:11 `horizon` is missing"
    ]


def test_another_kind_is_no_scenario(system: System) -> None:
    (line,) = problem_lines(lambda: read_scenario(document(RIG), SHIPPED, system))
    assert line == "2:9 `rig` is a system, not a scenario"


def test_the_shipped_manoeuvre_is_that_of_the_paper() -> None:
    made = read_system(read_document(SHIPPED.path_of("ev_driveline_ideal")), SHIPPED)
    scenario = read_scenario(read_document(SHIPPED.path_of("tip_out")), SHIPPED, made)
    assert steps(scenario, "T_req") == pairs((0, 30), (Fraction(4785, 10**4), -20))
    assert scenario.horizon == Fraction(5, 2)
    assert scenario.initial["plant.w_w"] == Fraction(40000, 3600) / Fraction(29, 100)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ('"a\\0b.csv"', "a file name has no control character, like U+0000 here"),
        ('"a\\tb.csv"', "a file name has no control character, like U+0009 here"),
        ("''", "`file` names no file"),
    ],
)
def test_a_recording_without_a_valid_file_name_is_refused_at_its_place(
    system: System, name: str, reason: str
) -> None:
    mapping = "time: {column: t, unit: s}, columns: {u: {to: u, unit: km/h}}"
    more = f"recording: {{file: {name}, {mapping}}}\n"
    lines = problem_lines(lambda: run(system, inputs="", more=more))
    assert any(reason in line for line in lines), lines
