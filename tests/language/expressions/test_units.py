"""Units: exact factors, dimensions, and what cannot be written; rule 20 is in test_angle.py."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import pint
import pytest
from hypothesis import given, strategies as st

from language.expressions.unit_symbols import BASE_SYMBOLS, MISSPELLED_UNITS, SYMBOLS
from language.expressions.units import (
    NO_UNIT,
    Dimension,
    UnitError,
    are_compatible,
    common_dimension,
    dimension_power,
    dimension_product,
    dimension_sqrt,
    display_unit,
    parse_unit,
    unit_hint,
    unit_without_parentheses,
)
from tests.language.si_factors import MEANING
from tests.language.spec_builders import automaton, raised_problems, si_value, tree

TURNING = {"deg": ("pi / 180", 0), "rev": ("2 * pi", 0), "rpm": ("2 * pi / 60", -1)}
"""Units with pi in their factor: the formula and the power of the second."""
ANGLES = ("rad", "mrad", "deg", "rev", "rpm")

symbols = st.sampled_from(sorted(SYMBOLS))
powers = st.integers(-3, 3)
dimensions = st.builds(
    Dimension,
    st.tuples(*[powers] * len(BASE_SYMBOLS)),
    st.one_of(st.none(), powers),
)


def pi_factor(formula: str) -> mpmath.mpf:
    parts = {"pi / 180": mpmath.pi / 180, "2 * pi": 2 * mpmath.pi, "2 * pi / 60": mpmath.pi / 30}
    return parts[formula]


@pytest.mark.parametrize("symbol", MEANING)
def test_a_unit_has_its_exact_factor_and_dimension(symbol: str) -> None:
    unit = parse_unit(symbol)
    factor, exponents = MEANING[symbol]
    assert unit.factor == factor
    assert unit.dimension.powers == tuple(exponents.get(base, 0) for base in BASE_SYMBOLS)


@pytest.mark.parametrize("symbol", TURNING)
def test_a_unit_of_turning_has_pi_to_more_digits_than_a_double(symbol: str) -> None:
    unit, (formula, seconds) = parse_unit(symbol), TURNING[symbol]
    with mpmath.workdps(60):
        exact = pi_factor(formula)
        written = mpmath.mpf(unit.factor.numerator) / unit.factor.denominator
        assert abs(written / exact - 1) < mpmath.mpf(10) ** -35
        assert unit.factor.numerator / unit.factor.denominator == float(exact)
    assert unit.dimension == Dimension((0, 0, seconds, 0, 0), 1)


PINT_NAMES = {"g": "gram", "h": "hour", "min": "minute", "degC": "kelvin", "rev": "turn"}
"""What pint calls a symbol, where it is another name or means another thing."""


@pytest.fixture(scope="module")
def registry() -> pint.UnitRegistry[Fraction]:
    return pint.UnitRegistry(non_int_type=Fraction)


@pytest.mark.parametrize("symbol", sorted(SYMBOLS))
def test_factors_and_powers_are_exactly_those_of_pint(
    symbol: str, registry: pint.UnitRegistry[Fraction]
) -> None:
    quantity = registry.Quantity(Fraction(1), PINT_NAMES.get(symbol, symbol)).to_base_units()
    factor, powers, _ = SYMBOLS[symbol]
    assert factor == quantity.magnitude
    bases = ("meter", "kilogram", "second", "ampere", "kelvin")
    found = {name: power for name, power in quantity.unit_items() if name != "radian"}
    assert found == {name: power for name, power in zip(bases, powers, strict=True) if power}


@pytest.mark.parametrize("written", sorted(MISSPELLED_UNITS))
def test_a_unit_as_people_write_it_is_proposed_as_it_is_written_here(written: str) -> None:
    with pytest.raises(UnitError):
        parse_unit(written)
    assert parse_unit(MISSPELLED_UNITS[written]).text in unit_hint(written)


def test_a_symbol_inside_a_unit_is_repaired_inside_it() -> None:
    assert unit_hint("m/sec") == "did you mean `m/s`?"
    assert unit_hint("kg*m^2/Rad") == "did you mean `kg*m^2/rad`?"
    assert unit_hint("furlong") == ""


def test_every_symbol_is_told_of_here() -> None:
    assert set(MEANING) | set(TURNING) == set(SYMBOLS)


@pytest.mark.parametrize("symbol", sorted(SYMBOLS))
def test_units_of_angles_have_the_power_1_of_the_angle_and_others_0(symbol: str) -> None:
    assert parse_unit(symbol).dimension.angle == (symbol in ANGLES)


def test_km_per_hour_is_1000_m_in_3600_s() -> None:
    assert parse_unit("km/h").factor == Fraction(1000, 3600)
    assert parse_unit("km/h").dimension == parse_unit("m/s").dimension


def test_60_rpm_are_a_turn_a_second() -> None:
    assert 60 * parse_unit("rpm").factor == parse_unit("rev/s").factor
    assert 360 * parse_unit("deg").factor == parse_unit("rev").factor
    assert parse_unit("rpm").dimension == parse_unit("rad/s").dimension


def test_1_over_counts_for_the_first_symbol_only() -> None:
    assert parse_unit("1/s").dimension == Dimension((0, 0, -1, 0, 0))
    assert parse_unit("1/s^2").dimension == Dimension((0, 0, -2, 0, 0))
    assert parse_unit("1/ms").factor == 1000
    assert parse_unit("1/m*s").dimension == parse_unit("s/m").dimension
    assert parse_unit("1/m/s").dimension == Dimension((-1, 0, -1, 0, 0))


def test_a_slash_counts_for_the_next_symbol_only() -> None:
    assert parse_unit("N*m*s/rad").dimension == Dimension((2, 1, -1, 0, 0), -1)
    assert parse_unit("m/s*kg").dimension == Dimension((1, 1, -1, 0, 0))
    assert parse_unit("kg*m^2").dimension == Dimension((2, 1, 0, 0, 0))


def test_no_unit_is_1() -> None:
    assert parse_unit("1") is NO_UNIT
    assert NO_UNIT.dimension.is_number


@given(symbols, symbols, powers, powers)
def test_factors_multiply_and_powers_add(a: str, b: str, i: int, j: int) -> None:
    whole, first, second = parse_unit(f"{a}^{i}*{b}^{j}"), parse_unit(a), parse_unit(b)
    assert whole.factor == first.factor**i * second.factor**j
    pairs = zip(first.dimension.powers, second.dimension.powers, strict=True)
    assert whole.dimension.powers == tuple(i * x + j * y for x, y in pairs)
    angles = (first.dimension.angle or 0, second.dimension.angle or 0)
    assert whole.dimension.angle == i * angles[0] + j * angles[1]


@pytest.mark.parametrize(
    "text",
    ["", " ", "N m", "m**2", "2m", "m^10", "m^2.5", "m^", "m*", "/s", "1/1/s", "m//s", "m ^2", "²"],
)
def test_what_is_not_written_as_a_unit_is_refused(text: str) -> None:
    with pytest.raises(UnitError, match="is not written as a unit"):
        parse_unit(text)


@pytest.mark.parametrize("text", ["furlong", "N*furlong", "1/furlong", "M", "KM", "Rad", "hour"])
def test_a_symbol_that_is_none_is_named(text: str) -> None:
    wrong = text.removeprefix("N*").removeprefix("1/")
    with pytest.raises(UnitError, match=f"`{wrong}` is not a unit"):
        parse_unit(text)


@given(dimensions)
def test_a_dimension_is_shown_as_a_unit_that_has_it(shown: Dimension) -> None:
    again = parse_unit(str(shown)).dimension
    assert again.powers == shown.powers
    assert again.angle == (shown.angle or 0)


def test_mechanics_is_shown_in_newtons() -> None:
    shown = [str(parse_unit(u).dimension) for u in ("kg*m^2/s^2", "kg*m/s^2", "J/s", "N/m^2")]
    assert shown == ["N*m", "N", "W", "Pa"]
    assert str(parse_unit("N*m*s/rad").dimension) == "N*m*s/rad"
    assert str(parse_unit("kg*m^2").dimension) == "kg*m^2"


def test_a_degree_celsius_in_a_product_is_a_kelvin() -> None:
    assert parse_unit("J/degC").offset == 0
    assert parse_unit("J/degC").dimension == parse_unit("J/K").dimension


@given(dimensions, dimensions)
def test_a_quotient_undoes_a_product(a: Dimension, b: Dimension) -> None:
    assert dimension_product(dimension_product(a, b), b, -1).powers == a.powers
    assert are_compatible(dimension_product(a, b), dimension_product(b, a))


@given(dimensions)
def test_a_square_has_the_root_that_it_is_of(a: Dimension) -> None:
    squared = dimension_sqrt(dimension_power(a, 2))
    assert squared is not None
    assert squared.powers == a.powers
    assert are_compatible(squared, a)


@given(dimensions, st.integers(2, 8))
def test_a_power_is_a_repeated_product(a: Dimension, n: int) -> None:
    repeated = a
    for _ in range(n - 1):
        repeated = dimension_product(repeated, a)
    assert dimension_power(a, n).powers == repeated.powers
    assert are_compatible(dimension_power(a, n), repeated)


def test_an_odd_power_has_no_root() -> None:
    assert dimension_sqrt(parse_unit("m").dimension) is None
    assert dimension_sqrt(parse_unit("rad").dimension) is None
    assert dimension_sqrt(Dimension((2, 0, 0, 0, 0), None)) == Dimension((1, 0, 0, 0, 0), None)


@given(dimensions, dimensions)
def test_fitting_is_mutual_and_a_sum_has_the_exact_angle(a: Dimension, b: Dimension) -> None:
    assert are_compatible(a, b) == are_compatible(b, a)
    if are_compatible(a, b):
        together = common_dimension(a, b)
        assert together.powers == a.powers
        assert together.angle == (b.angle if a.angle is None else a.angle)


def bounds(low: int, high: int | Fraction) -> tuple[Fraction, Fraction]:
    return Fraction(low), Fraction(high)


def test_units_convert_where_a_value_is_declared() -> None:
    text = """language: 1
automaton: declared
parameters:
  v: {value: 36 km/h, range: [0, 72]}
  f: {value: 60, unit: rpm, range: [0 rpm, 2 rev/s]}
  T: {value: 20 degC, range: [-10, 40]}
  c: {value: -10, unit: degC}
  d: {value: -10 degC}
inputs: {p: {unit: bar, default: 2, range: [0, 5]}}
states: {x: {unit: mm, initial: 3 mm, range: [-5, 5]}}
flow: {x: der(x) = 0}
modes: {only: {}}
"""
    made = automaton(text)
    values = {name: thing.value for name, thing in made.parameters.items()}
    assert values["v"] == 10
    assert made.parameters["v"].range == bounds(0, 20)
    assert math.isclose(values["f"] or 0, 2 * math.pi)
    assert made.parameters["f"].range == bounds(0, si_value("2 rev/s"))
    assert values["T"] == Fraction(29315, 100)
    assert made.parameters["T"].range == (Fraction(26315, 100), Fraction(31315, 100))
    assert values["c"] == values["d"] == Fraction(26315, 100)
    assert made.inputs["p"].default == 2 * 10**5
    assert made.inputs["p"].range == bounds(0, 5 * 10**5)
    assert made.states["x"].range == (Fraction(-5, 1000), Fraction(5, 1000))


@pytest.mark.parametrize("text", ["V", "ohm", "N/m", "A*s/V", "V*s/A", "K/W", "N*m", "W", "Pa"])
def test_a_dimension_is_shown_by_its_common_name(text: str) -> None:
    assert display_unit(str(parse_unit(text).dimension)) == display_unit(text) == text


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("1/(kg*m^2)", "1/kg/m^2"),
        ("N/(m*s)", "N/m/s"),
        ("1/(kg/m)", "1/kg*m"),
        ("(N*m)/rad", "N*m/rad"),
        ("(kg*m)/(s*A)", "kg*m/s/A"),
        ("1/(kgs*m)", ""),
        ("1/(s)/(m)", "1/s/m"),
        ("N*m", ""),
    ],
)
def test_a_unit_with_parentheses_is_shown_without_them(text: str, written: str) -> None:
    assert unit_without_parentheses(text) == written
    if written:
        assert unit_hint(text) == f"a unit has no parentheses: write `{written}`"


def test_a_unit_with_parentheses_in_an_expression() -> None:
    (problem,) = raised_problems(lambda: tree("u * 2 1/(kg*m^2) + 1"))
    assert problem.label == "`1/(kg*m^2)` is not written as a unit"
    assert (problem.span.column, problem.span.width) == (7, 10)
    assert problem.help == "a unit has no parentheses: write `1/kg/m^2`"
