"""Parse, refused: what is no expression of docs/language.md, and where it is said."""

from __future__ import annotations

import pytest

from language.expressions.parser import MAX_EXPRESSION_LENGTH, parse_balance
from language.expressions.syntax_tree import Name
from tests.language.spec_builders import raised_problems, scalar, tree

NO_PRODUCT = "there is no implied multiplication"


def first(text: str) -> tuple[int, str, str]:
    """Return column, label and help of the one problem of a text."""
    (problem,) = raised_problems(lambda: tree(text))
    return problem.span.column, problem.label, problem.help


@pytest.mark.parametrize(
    ("text", "column", "label"),
    [
        ("", 1, "the expression ends too early"),
        ("a < b < c", 7, "an expression has one relation only"),
        ("a == b != c", 8, "an expression has one relation only"),
        ("a = b", 3, "`=` is not part of an expression"),
        ("x y", 3, "`y` was not expected here"),
        ("2 (x)", 3, "`(x)` was not expected here"),
        ("a)", 2, "`)` was not expected here"),
        ("a && b", 3, "`&&` is not part of an expression"),
        ("x**2", 2, "`**` is not part of an expression"),
        ("a * * b", 5, "`*` was not expected here"),
        ("f()", 3, "`)` was not expected here"),
        ("a + é", 5, "`é` was not expected here"),
        ("a & b", 3, "`&` was not expected here"),
        ("x^2^3", 4, "`^3` was not expected here"),
        ("x^n", 3, "`n` was not expected here"),
        ("x^2.5", 3, "`2.5` was not expected here"),
        ("1 + if a then b else c", 5, "`if` was not expected here"),
        ("a not b", 3, "`not` was not expected here"),
        ("a and and b", 7, "`and` was not expected here"),
        ("a, b", 2, "`,` was not expected here"),
        ("[a]", 1, "a condition stands without brackets"),
        ("3 m s", 5, "`s` was not expected here"),
        ("3  m", 4, "`m` was not expected here"),
        (".5", 1, "`.5` was not expected here"),
        ("_x", 1, "`_x` was not expected here"),
        ("x^9", 3, "a power is at most 8"),
        ("x^-9", 3, "a power is at most 8"),
        ("a + 3 furlong", 7, "`furlong` is not a unit"),
        ("2 x", 3, "`x` is not a unit"),
        ("2x", 1, "`2x` is not a number"),
        ("a + 3m", 5, "`3m` is not a number"),
        ("1.", 1, "`1.` is not a number"),
        ("1.2.3", 1, "`1.2.3` is not a number"),
        ("0x1F", 1, "`0x1F` is not a number"),
        ("1_000", 1, "`1_000` is not a number"),
        ("a + 1e-3", 5, "`1e-3` has an exponent but no point"),
        ("1e3 m", 1, "`1e3` has an exponent but no point"),
        ("a + 010", 5, "`010` starts with a zero"),
        ("1.0e309", 1, "`1.0e309` is out of the range of a double"),
        ("a\nb", 1, "an expression is written on one line"),
    ],
)
def test_it_is_refused_at_its_place(text: str, column: int, label: str) -> None:
    assert first(text)[:2] == (column, label)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("x y", NO_PRODUCT),
        ("2 (x)", NO_PRODUCT),
        ("2 x", "a unit is written like `W`, `N*m`, `1/s`, a product with `*`: `2 * x`"),
        ("900 Watt", "did you mean `W`?"),
        ("100ms", "one blank stands before the unit: `100 ms`"),
        ("1.5kN", "one blank stands before the unit: `1.5 kN`"),
        ("0x1F", "write it as `1.0e-3` or `12.5`"),
        ("a && b", "it is written `and`"),
        ("a||b", "it is written `or`"),
        ("a and !b", "it is written `not`"),
        ("a and ~b", "it is written `not`"),
        ("a ~= b", "it is written `!=`"),
        ("x**2", "it is written `^`"),
        ("a < b < c", "write `a < b and b < c`"),
        ("a = b", "equality is written `==`"),
        ("1e-3", "write `1.0e-3`: other YAML tools read `1e-3` as a text"),
        ("010", "write `10`: other YAML tools read `010` as octal"),
        ("3 rpn", "did you mean `rpm`?"),
        ("max(a", "in `{...}` YAML ends a value at a comma: quote a value that has one"),
    ],
)
def test_the_help_says_how_it_is_written(text: str, hint: str) -> None:
    assert first(text)[2] == hint


ENDS = [
    ("a and", 6),
    ("a +", 4),
    ("if a then b", 12),
    ("if a", 5),
    ("not", 4),
    ("x^", 3),
]


@pytest.mark.parametrize(("text", "column"), ENDS)
def test_an_expression_that_ends_too_early_is_told_so_behind_its_end(
    text: str, column: int
) -> None:
    assert first(text)[:2] == (column, "the expression ends too early")


@pytest.mark.parametrize("text", ["x^10", "x^-10", "x^99"])
def test_a_power_of_two_digits_is_told_that_8_is_the_most(text: str) -> None:
    assert first(text)[1] == "a power is at most 8"


def test_the_number_proposed_can_be_written() -> None:
    assert first("00.5")[2].startswith("write `0.5`")


@pytest.mark.parametrize("text", ["9.9e308", "9" * 400, "12345.0e305"])
def test_a_number_past_the_largest_double_is_refused(text: str) -> None:
    assert first(text)[1].endswith("is out of the range of a double")


@pytest.mark.parametrize("text", ["-x", "not x", "x^2", "f(x)"])
def test_an_operation_has_the_place_of_all_that_it_is_written_with(text: str) -> None:
    span = tree(text).span
    assert (span.column, span.width) == (1, len(text))


@pytest.mark.parametrize("text", ["J * der(w)", "", "J * der(w) T"])
def test_a_balance_without_equality_is_refused(text: str) -> None:
    (problem,) = raised_problems(lambda: parse_balance(scalar(text)))
    assert problem.label == "a balance is `coefficient * der(x) = ...`"


@pytest.mark.parametrize(("text", "column"), [("a = b = c", 7), ("a = b < c = d", 11)])
def test_a_balance_has_one_equality(text: str, column: int) -> None:
    (problem,) = raised_problems(lambda: parse_balance(scalar(text)))
    assert problem.span.column == column


@pytest.mark.parametrize("text", ["-" * 1500 + "x", "+".join("x" * 900), "not " * 490 + "x"])
def test_what_is_nested_too_deeply_is_refused_not_a_crash(text: str) -> None:
    assert first(text)[1] == "the expression is nested too deeply"


def test_parentheses_alone_nest_nothing() -> None:
    assert isinstance(tree("(" * 900 + "x" + ")" * 900), Name)


def test_an_expression_of_the_longest_length_is_read_and_a_longer_one_refused() -> None:
    longest = "x" + " " * (MAX_EXPRESSION_LENGTH - 1)
    assert isinstance(tree(longest), Name)
    assert (
        first(longest + " ")[1]
        == f"an expression of {MAX_EXPRESSION_LENGTH + 1} characters is too long"
    )
