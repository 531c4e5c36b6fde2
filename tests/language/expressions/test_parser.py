"""Parse: the grammar of docs/language.md, "Expressions", and what is refused, with its place."""

from __future__ import annotations

import re
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from language.expressions.number_literal import parse_decimal_literal
from language.expressions.parser import parse_balance, parse_expression
from language.expressions.syntax_tree import (
    Arithmetic,
    BoolLiteral,
    Conditional,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    NumberLiteral,
    Power,
    Relation,
    SyntaxTree,
    walk,
)
from language.expressions.units import NO_UNIT, parse_unit
from language.text.diagnostic import Source
from language.text.document import ScalarNode
from language.text.yaml_parser import parse_yaml
from tests.language.spec_builders import NOWHERE, raised_problems, scalar, tree

SUM, PRODUCT, SIGN, POWER, ATOM = 5, 6, 7, 8, 9
UNITS = ("m", "1/s", "N*m", "rad/s", "m^2", "N*m*s/rad", "deg", "m^-1", "1/s^2")
NAMES = ("x", "theta_b", "iffy", "note", "order", "e1", "a.b", "est.T_hs", "true_value")

names = st.builds(Name, st.sampled_from(NAMES), st.just(NOWHERE))
decimals = st.builds(
    lambda whole, part: f"{whole}.{part}" if part else str(whole),
    st.integers(0, 999),
    st.text("0123456789", max_size=3),
)


@st.composite
def numbers(draw: st.DrawFn) -> SyntaxTree:
    text, unit = draw(decimals), draw(st.sampled_from((None, *UNITS)))
    found = parse_unit(unit) if unit else NO_UNIT
    return NumberLiteral(Fraction(text) * found.factor, found, NOWHERE)


def combined(parts: st.SearchStrategy[SyntaxTree]) -> st.SearchStrategy[SyntaxTree]:
    at = st.just(NOWHERE)
    relations = st.sampled_from(["<", "<=", ">", ">=", "==", "!="])
    arguments = st.lists(parts, min_size=1, max_size=3).map(tuple)
    return st.one_of(
        st.builds(Negation, parts, at),
        st.builds(Not, parts, at),
        st.builds(Arithmetic, st.sampled_from(["+", "-", "*", "/"]), parts, parts, at),
        st.builds(Arithmetic, st.sampled_from(["+", "-", "*", "/"]), parts, parts, at),
        st.builds(Relation, relations, parts, parts, at),
        st.builds(Logic, st.sampled_from(["and", "or"]), parts, parts, at),
        st.builds(Power, parts, st.integers(-8, 8), at),
        st.builds(Conditional, parts, parts, parts, at),
        st.builds(FunctionCall, st.sampled_from(["max", "sin", "in", "f"]), arguments, at),
    )


leaves = st.one_of(names, numbers(), st.builds(BoolLiteral, st.booleans(), st.just(NOWHERE)))
trees = st.recursive(leaves, combined, max_leaves=12)


def literal(number: NumberLiteral) -> str:
    """Return a literal; a value that came from decimals has a decimal again."""
    digits = number.value / number.unit.factor
    scaled = digits * 10**3
    assert scaled.denominator == 1
    whole, part = divmod(int(scaled), 10**3)
    unit = "" if number.unit is NO_UNIT else f" {number.unit.text}"
    return f"{whole}.{part:03d}{unit}"


def full(part: SyntaxTree) -> str:
    """Return a tree as text, every operation in parentheses."""
    text, _ = written(part, lambda child, _: f"({full(child)})")
    return text


def least(part: SyntaxTree) -> str:
    """Return a tree as text with the parentheses that it needs."""

    def inner(child: SyntaxTree, level: int) -> str:
        text, own = written(child, inner)
        return text if own >= level else f"({text})"

    return written(part, inner)[0]


def written(part: SyntaxTree, inner: object) -> tuple[str, int]:
    """Return a tree as text and how tightly it binds; `inner(child, level)` writes a part."""
    assert callable(inner)
    match part:
        case NumberLiteral(_, unit, _):
            return literal(part), ATOM if unit is NO_UNIT else POWER
        case BoolLiteral(value, _):
            return str(value).lower(), ATOM
        case Name(path, _):
            return path, ATOM
        case Negation(operand, _):
            return f"-{inner(operand, SIGN)}", SIGN
        case Not(operand, _):
            return f"not {inner(operand, 3)}", 3
        case Arithmetic(operator, left, right, _):
            level = SUM if operator in "+-" else PRODUCT
            return f"{inner(left, level)} {operator} {inner(right, level + 1)}", level
        case Relation(operator, left, right, _):
            return f"{inner(left, SUM)} {operator} {inner(right, SUM)}", 4
        case Logic(operator, left, right, _):
            level = 1 if operator == "or" else 2
            return f"{inner(left, level)} {operator} {inner(right, level + 1)}", level
        case Power(base, exponent, _):
            return f"{inner(base, ATOM)}^{exponent}", POWER
        case Conditional(condition, then, other, _):
            parts = [inner(child, 0) for child in (condition, then, other)]
            return "if {} then {} else {}".format(*parts), 0
        case FunctionCall(function, arguments, _):
            return f"{function}({', '.join(inner(child, 0) for child in arguments)})", ATOM
        case _:
            raise AssertionError(part)


@given(trees)
def test_a_tree_with_every_parenthesis_is_read_again(part: SyntaxTree) -> None:
    assert tree(full(part)) == part


@given(trees)
def test_a_tree_with_the_parentheses_that_it_needs_is_read_again(part: SyntaxTree) -> None:
    assert tree(least(part)) == part


@given(trees)
def test_blanks_around_operators_are_of_no_account(part: SyntaxTree) -> None:
    text = least(part)
    spaced = re.sub(r" ([-+*/<>=!]{1,2}) ", r"   \1   ", text)
    assert tree(f"  {spaced} ") == part


@given(trees)
def test_every_part_knows_a_place_inside_the_text(part: SyntaxTree) -> None:
    text = least(part)
    for found in walk(tree(text)):
        assert found.span.column >= 1
        assert found.span.column + found.span.width - 1 <= len(text)
        if isinstance(found, Name):
            assert text[found.span.column - 1 :].startswith(found.path)


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("-x^2", "-(x^2)"),
        ("-x * y", "(-x) * y"),
        ("x * -y", "x * (-y)"),
        ("a - b - c", "(a - b) - c"),
        ("a / b / c", "(a / b) / c"),
        ("a / b * c", "(a / b) * c"),
        ("a + b * c", "a + (b * c)"),
        ("a < b + c", "a < (b + c)"),
        ("not a < b", "not (a < b)"),
        ("not a and b", "(not a) and b"),
        ("a or b and c", "a or (b and c)"),
        ("a and b and c", "(a and b) and c"),
        ("if a then b else if c then d else e", "if a then b else (if c then d else e)"),
        ("if a or b then c + d else e", "if (a or b) then (c + d) else e"),
        ("x^-2 * y", "(x^-2) * y"),
        ("20 N*m * w", "(20 N*m) * w"),
        ("5 1/s - 3 1/s", "(5 1/s) - (3 1/s)"),
        ("if x > 3 then 1 else 2", "if (x > (3)) then (1) else (2)"),
        ("2 < x or 3 < y and 4 < z", "(2 < x) or ((3 < y) and (4 < z))"),
    ],
)
def test_what_binds_more_tightly(text: str, same: str) -> None:
    assert tree(text) == tree(same)


def test_a_power_is_not_a_quotient_and_a_difference_is_not_a_sum() -> None:
    assert tree("x^-2") != tree("1 / x^2")
    assert tree("a - b") != tree("a + -b")
    assert tree("a < b") != tree("b > a")


def test_a_literal_is_exact() -> None:
    for text, value in [
        ("0.1", Fraction(1, 10)),
        ("1.0e-3", Fraction(1, 1000)),
        ("0", Fraction(0)),
    ]:
        number = tree(text)
        assert isinstance(number, NumberLiteral)
        assert (number.value, number.unit) == (value, NO_UNIT)
    assert parse_decimal_literal("12.5", NOWHERE) == Fraction(25, 2)
    assert parse_decimal_literal("2.5E+2", NOWHERE) == 250


def test_a_unit_follows_its_number_after_one_blank() -> None:
    for text, value, unit in [
        ("3 mm", Fraction(3, 1000), "mm"),
        ("5 1/ms", Fraction(5000), "1/ms"),
    ]:
        number = tree(text)
        assert isinstance(number, NumberLiteral)
        assert (number.value, number.unit.text) == (value, unit)


def test_a_balance_has_two_sides() -> None:
    left, right = parse_balance(scalar("J * der(w) = T - b * w"))
    assert left == tree("J * der(w)")
    assert right == tree("T - b * w")


def test_a_place_counts_from_the_first_character_behind_a_quote() -> None:
    text = "{a: x + y, b: \"x + y\", c: '  x + y'}"
    table = parse_yaml(Source("here", (text,)), text)
    for key in ("a", "b", "c"):
        node = table.get(key)
        assert isinstance(node, ScalarNode)
        spans = [part.span for part in walk(parse_expression(node)) if isinstance(part, Name)]
        assert [text[span.column - 1] for span in spans] == ["x", "y"]


def test_a_refusal_inside_quotes_is_placed_where_it_is() -> None:
    text = '{a: "x + é"}'
    node = parse_yaml(Source("here", (text,)), text).get("a")
    assert isinstance(node, ScalarNode)
    (problem,) = raised_problems(lambda: parse_expression(node))
    assert text[problem.span.column - 1] == "é"
