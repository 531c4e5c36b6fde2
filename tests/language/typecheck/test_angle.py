"""Angle: the examples of docs/language.md, "Names, numbers, units", and of rule 20b."""

from __future__ import annotations

import pytest

from language.expressions.syntax_tree import NumberLiteral
from language.expressions.units import Dimension
from language.lowering.expressions import lower_expression
from language.numerics.evaluate import evaluate
from language.text.diagnostic import Problems
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from tests.language.spec_builders import automaton, dimension, problem_labels, problem_lines, tree

UNITS = {
    "w_em": "rad/s",
    "w": "rad/s",
    "dw": "rad/s^2",
    "R": "1",
    "theta": "rad",
    "theta_b": "rad",
    "J": "kg*m^2",
    "T": "N*m",
    "k": "N*m/rad",
    "v": "m/s",
    "r_w": "m",
    "t": "s",
}
PLACE = NameEnvironment({name: dimension(unit) for name, unit in UNITS.items()})


def kind(text: str) -> object:
    """Return what an expression is; None if something in it is refused."""
    problems = Problems()
    found = TypeChecker(PLACE, problems).infer_type(tree(text))
    return None if problems.has_errors else found


def angle(text: str) -> int | None:
    found = kind(text)
    assert isinstance(found, Dimension)
    return found.angle


def fitting(text: str, unit: str) -> bool:
    problems = Problems()
    TypeChecker(PLACE, problems).check_quantity(tree(text), dimension(unit), "it")
    return not problems.has_errors


@pytest.mark.parametrize("text", ["theta", "3 deg", "theta + 3 deg", "max(theta, 3 deg)"])
def test_a_name_a_literal_a_sum_and_a_function_value_have_their_exact_power(text: str) -> None:
    assert angle(text) == 1
    assert fitting(text, "rad")
    assert not fitting(text, "1")


@pytest.mark.parametrize(
    ("text", "unit"),
    [("w_em / R", "rad/s"), ("2 * theta_b", "rad"), ("theta / 2", "rad"), ("1 / w", "s/rad")],
)
def test_a_factor_without_dimension_keeps_the_power_of_the_other(text: str, unit: str) -> None:
    assert kind(text) == dimension(unit)
    assert not fitting(text, unit + "*rad")


@pytest.mark.parametrize(
    ("text", "units"),
    [
        ("J * dw", ["N*m", "N*m*rad"]),
        ("T / J", ["rad/s^2", "1/s^2"]),
        ("v / r_w", ["rad/s", "1/s"]),
        ("w * r_w", ["m/s", "m*rad/s"]),
        ("k * theta", ["N*m"]),
        ("w^2", ["1/s^2", "rad^2/s^2"]),
    ],
)
def test_a_product_or_quotient_of_two_with_dimensions_is_free(text: str, units: list[str]) -> None:
    assert angle(text) is None
    assert all(fitting(text, unit) for unit in units)
    assert not fitting(text, "V")


@pytest.mark.parametrize(
    "text", ["w + v / r_w", "v / r_w - w", "max(v / r_w, w)", "max(w, T / J * t)"]
)
def test_a_sum_of_a_free_value_and_an_exact_one_is_exact(text: str) -> None:
    assert kind(text) == dimension("rad/s")
    assert not fitting(text, "1/s")


def test_angles_alone_multiply_exactly() -> None:
    assert angle("theta * theta_b") == 2
    assert angle("theta^3") == 3
    assert angle("theta / theta_b") == 0
    assert angle("sqrt(theta^2)") == 1


@pytest.mark.parametrize("text", ["sin(theta)", "cos(3 deg)", "sin(v / r_w * t)", "cos(0)"])
def test_sin_takes_an_angle_or_a_free_value(text: str) -> None:
    assert kind(text) == dimension("1")


@pytest.mark.parametrize("text", ["sin(2)", "sin(R)", "sin(theta^2)", "cos(T)", "sin(1 / theta)"])
def test_sin_takes_nothing_else(text: str) -> None:
    assert kind(text) is None


@pytest.mark.parametrize("text", ["exp(theta)", "tanh(3 deg)", "exp(T)", "sqrt(theta)"])
def test_exp_and_tanh_take_a_number_and_an_angle_has_no_root(text: str) -> None:
    assert kind(text) is None
    assert kind("exp(r_w / (v * t))") == dimension("1")


@pytest.mark.parametrize("text", ["theta_b > 0.02", "theta + 3", "theta + theta^2", "w > 1 1/s"])
def test_an_angle_without_its_unit_is_refused(text: str) -> None:
    assert kind(text) is None


@pytest.mark.parametrize("unit", ["deg", "rev", "mrad"])
def test_a_bare_number_is_no_angle_but_a_literal_converts(unit: str) -> None:
    assert kind("theta > 3") is None
    assert kind(f"theta > 3 {unit}") == "truth"
    literal = tree(f"3 {unit}")
    assert isinstance(literal, NumberLiteral)
    assert literal.value == 3 * literal.unit.factor != 3


def test_deg_and_rad_by_two_declared_numbers_are_not_added() -> None:
    text = """language: 1
automaton: both
parameters: {a: {value: 3 deg}, b: {value: 0.1 rad}, c: {derived: a + b, unit: rad}}
states: {x: {unit: m, initial: 0 m}}
flow: {x: der(x) = 0}
modes: {only: {}}
"""
    assert problem_lines(lambda: automaton(text)) == ["3:67 `+` joins `deg` and `rad`"]
    assert problem_lines(lambda: automaton(text.replace("0.1 rad", "6 deg"))) == []
    assert problem_lines(lambda: automaton(text.replace("a + b", "a + 0.1 rad"))) == []


@pytest.mark.parametrize("unit", ["N*m", "rad", "degC", "m/s", "1"])
def test_a_bare_0_goes_with_anything(unit: str) -> None:
    assert fitting("0", unit)


@pytest.mark.parametrize(
    "text", ["T + 0", "0 - theta", "w > 0", "max(v, 0)", "if v > 0 then T else 0"]
)
def test_a_bare_0_goes_into_any_sum_relation_and_choice(text: str) -> None:
    assert kind(text) is not None


@pytest.mark.parametrize(
    "text", ["T + 3", "3 - theta", "w > 1", "max(v, 1)", "0 s + T", "T > 0 rad"]
)
def test_any_other_bare_number_has_no_dimension(text: str) -> None:
    assert kind(text) is None
    assert kind("R + 3") == dimension("1")


def test_the_power_0_of_a_number_or_an_angle_is_a_number() -> None:
    assert kind("R^0") == kind("theta^0") == dimension("1")


def test_the_power_0_of_a_quantity_is_a_number() -> None:
    assert kind("T^0") == dimension("1")


@pytest.mark.parametrize("text", ["20 degC - 10 degC", "3 K + 20 degC", "20 degC + 3 K"])
def test_degrees_celsius_are_not_added_or_subtracted(text: str) -> None:
    assert kind(text) is None
    assert kind("20 degC > 3 K") == "truth"


def test_degrees_celsius_below_zero_are_not_added_or_subtracted() -> None:
    assert kind("3 K - -10 degC") is None


def test_degrees_celsius_are_kelvins_in_an_expression() -> None:
    assert evaluate(lower_expression(tree("20 degC"), {}), {}) == 293.15


def test_degrees_celsius_below_zero_are_kelvins_in_an_expression() -> None:
    assert evaluate(lower_expression(tree("-10 degC"), {}), {}) == 263.15


def test_the_hint_says_what_is_missing() -> None:
    problems = Problems()
    check = TypeChecker(PLACE, problems)
    check.infer_type(tree("theta_b > 0.02"))
    check.check_quantity(tree("w_em"), dimension("1/s"), "it")
    assert problem_labels(problems) == [
        "`>` joins `rad` and `1`",
        "this is in `rad/s`, `it` is in `1/s`",
    ]
    assert [problem.help for problem in problems.reported] == [
        "give the unit of the angle: `0.02 rad`, `3 deg`",
        "they differ in the power of the angle (rad)",
    ]
