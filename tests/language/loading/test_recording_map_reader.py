"""Map: how the columns of a recording become signals."""

from __future__ import annotations

from fractions import Fraction

import pytest

from language.loading.recording_map_reader import column_dimension, read_map
from language.model.system import ColumnMapping, RecordingMap
from language.overlays.expand_document import read_document
from tests.language.spec_builders import (
    SHIPPED,
    dimension,
    document,
    problem_lines,
    raised_problems,
)

TEXT = """language: 1
map: some
time: {time}
columns: {{{columns}}}
{more}
"""
NO_NUMBER = "`b` is a number with a unit, not an expression"
TIME = "{column: t, unit: ms}"


def some(columns: str = "a: {to: u}", time: str = TIME, more: str = "") -> RecordingMap:
    return read_map(document(TEXT.format(columns=columns, time=time, more=more)), SHIPPED)


def one(keys: str) -> ColumnMapping:
    (column,) = some(f"a: {{{keys}}}").columns.values()
    return column


def lines(*parts: str) -> list[str]:
    return [line.partition(" ")[2] for line in problem_lines(lambda: some(*parts))]


def test_a_column_is_that_of_its_name_unless_it_says_which() -> None:
    assert one("to: u").columns == ("a",)
    assert one("to: u, column: em torque (Nm)").columns == ("em torque (Nm)",)
    assert one("to: u, mean: [left, right]").columns == ("left", "right")


def test_a_column_is_fed_to_an_input_or_compared_with_an_output() -> None:
    assert (one("to: u").to, one("to: u").compare) == ("u", None)
    assert (one("compare: w").to, one("compare: w").compare) == (None, "w")


def test_a_column_is_taken_as_it_is_unless_it_says_more() -> None:
    plain = one("to: u")
    assert (plain.sign, plain.blank, plain.time) == (1, "refuse", None)
    assert (plain.file_unit, one("to: u, file_unit: Nm/s").file_unit) == ("", "Nm/s")
    assert (plain.delay, plain.scale) == (Fraction(0), (Fraction(1), dimension("1")))
    assert column_dimension(plain) == dimension("1")


def test_unit_sign_delay_blank_and_time_are_read() -> None:
    found = one("to: u, unit: rpm, sign: -1, delay: 20 ms, blank: skip, hold: previous, time: t2")
    assert found.unit.dimension == dimension("rad/s")
    assert (found.sign, found.delay, found.blank, found.time) == (-1, Fraction(1, 50), "skip", "t2")


@pytest.mark.parametrize(
    ("keys", "unit"),
    [
        ("unit: km/h, scale: 1 rad / 0.3183 m", "rad/s"),
        ("unit: N*m, scale: 2", "N*m"),
        ("unit: V, scale: 3 A", "W"),
        ("unit: rpm, scale: 60", "rad/s"),
    ],
)
def test_a_column_has_the_dimension_of_its_unit_times_its_scale(keys: str, unit: str) -> None:
    assert column_dimension(one(f"to: u, {keys}")).powers == dimension(unit).powers


def test_a_scale_is_exact() -> None:
    assert one("to: u, scale: 1 rad / 0.3183 m").scale[0] == Fraction(10000, 3183)
    assert one("to: u, scale: -1 / 3").scale[0] == Fraction(-1, 3)


def test_time_has_a_column_and_a_unit() -> None:
    made = some()
    assert (made.time, made.time_unit.factor) == ("t", Fraction(1, 1000))


def test_constants_feed_what_no_column_does() -> None:
    made = some(more="constants: {T_br: 20 N*m, slope: 3 deg}")
    assert made.constants["T_br"] == (Fraction(20), dimension("N*m"))
    assert made.constants["slope"][1] == dimension("rad")


@pytest.mark.parametrize(
    ("keys", "label"),
    [
        ("unit: m", "a column has `to` (an input) or `compare` (an output)"),
        ("to: u, compare: w", "a column has `to` (an input) or `compare` (an output)"),
        ("to: u, column: b, mean: [c, d]", "`column` and `mean` exclude each other"),
        ("to: u, mean: c", "`columns.a.mean` is a list"),
        ("to: u, unit: furlong", "`furlong` is not a unit"),
        ("to: u, sign: 0", "`0` is not one of 1, -1"),
        ("to: u, sign: plus", "`plus` is not one of 1, -1"),
        ("to: u, hold: cubic", "`cubic` is not one of previous, linear"),
        ("to: u, blank: fill", "`fill` is not one of refuse, skip"),
        ("to: u, delay: 3", "`delay` is a time of at least 0 s"),
        ("to: u, delay: -3 ms", "`delay` is a time of at least 0 s"),
        ("to: u, delay: 3 m", "`delay` is a time of at least 0 s"),
        ("to: u, scale: 1 / 0", "this divides by zero"),
        ("to: u, scale: k", "this is made of numbers with units only"),
        ("to: u, scale: 1 m + 1 s", "`+` joins `m` and `s`"),
        ("to: u, factor: 3", "`factor` is not a key of `columns.a`"),
    ],
)
def test_a_column_that_is_wrong_is_refused(keys: str, label: str) -> None:
    assert label in lines(f"a: {{{keys}}}")


@pytest.mark.parametrize(
    ("parts", "label"),
    [
        (("",), "a map has at least one column in `columns`"),
        (("a: {to: u}", "{unit: s}"), "`time.column` is missing"),
        (("a: {to: u}", "{column: t}"), "the unit of `time` is a time"),
        (("a: {to: u}", "{column: t, unit: m}"), "the unit of `time` is a time"),
        (("a: {to: u}", TIME, "rows: 3"), "`rows` is not a key of `map some`"),
        (
            ("a: {to: u}", TIME, "constants: {b: k}"),
            "`b` is a number with a unit, not an expression",
        ),
    ],
)
def test_a_map_that_is_wrong_is_refused(parts: tuple[str, ...], label: str) -> None:
    assert label in lines(*parts)


def test_all_mistakes_are_told_in_one_run() -> None:
    assert len(lines("a: {unit: m}, b: {to: u, sign: 3}, c: {to: v, delay: 1}")) == 3


def test_a_delay_of_a_bare_0_is_none() -> None:
    assert one("to: u, delay: 0").delay == 0


def test_a_mean_of_nothing_is_refused() -> None:
    assert lines("a: {to: u, mean: []}")


@pytest.mark.parametrize("name", ["reference_trace", "leaf_can"])
def test_the_shipped_maps_are_read(name: str) -> None:
    made = read_map(read_document(SHIPPED.path_of(name)), SHIPPED)
    assert made.name == name
    assert {"T_em", "y_em", "y_w"} <= {column.to for column in made.columns.values()}


def test_another_kind_is_no_map() -> None:
    document_ = read_document(SHIPPED.path_of("driveline"))
    (problem,) = raised_problems(lambda: read_map(document_, SHIPPED))
    assert problem.label == "`driveline` is an automaton, not a map"


@pytest.mark.parametrize(
    "more",
    ['dbc: "a\\0b.dbc"', 'dbc: [a.dbc, "b\\n.dbc"]', 'windows: {"a\\e[31m.csv": [[0 s, 1 s]]}'],
)
def test_a_file_name_with_a_control_character_is_refused(more: str) -> None:
    (line,) = problem_lines(lambda: some(more=more))
    assert line.startswith("5:")
    assert "a file name has no control character, like U+" in line
