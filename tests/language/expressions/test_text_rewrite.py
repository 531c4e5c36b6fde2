"""Rewrite: changing names in a text is changing names in its tree."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from language.expressions.parser import parse_balance, parse_expression
from language.expressions.syntax_tree import names
from language.expressions.text_rewrite import (
    join_summands,
    names_in_text,
    rename_names,
    split_balance,
    split_summands,
    substitute_reads,
)
from tests.language.spec_builders import scalar

leaves = st.sampled_from(["a", "b", "ab", "m", "x_1", "2", "0.5", "3 m", "2.0e-3 N*m", "5 1/s"])
expressions = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map(" ".join),
        inner.map(lambda e: f"({e})"),
        inner.map(lambda e: f"({e})^2"),
        inner.map(lambda e: f"-({e})"),
        inner.map(lambda e: f"abs({e})"),
        st.tuples(inner, inner).map(lambda p: f"max({p[0]}, {p[1]})"),
        st.tuples(inner, inner, inner).map(
            lambda p: f"(if {p[0]} < {p[1]} then {p[2]} else {p[0]})"
        ),
    ),
    max_leaves=8,
)


@given(expressions)
def test_a_name_is_replaced_wherever_it_is_read_and_nothing_else_is(text: str) -> None:
    before = [name.path for name in names(parse_expression(scalar(text)))]
    new, found = substitute_reads(text, {"a": "zz", "m": "yy"})
    after = [name.path for name in names(parse_expression(scalar(new)))]
    assert after == [{"a": "zz", "m": "yy"}.get(name, name) for name in before]
    assert found == {"a", "m"} & set(before)
    assert names_in_text(text) == before


@given(expressions, expressions)
def test_what_is_put_for_a_name_is_one_operand(text: str, put: str) -> None:
    """Substituting in the text and in the tree are one: parse(text[a := put])."""
    new, _ = substitute_reads(text, {"a": put})
    marked, _ = substitute_reads(text, {"a": "qq"})
    by_tree = repr(parse_expression(scalar(marked))).replace(
        repr(parse_expression(scalar("qq"))),
        repr(parse_expression(scalar(put))),
    )
    assert repr(parse_expression(scalar(new))) == by_tree


@given(st.lists(st.tuples(st.sampled_from("+-"), expressions), min_size=1, max_size=4))
def test_summands_are_those_of_the_top_level(parts: list[tuple[str, str]]) -> None:
    wrapped = [(sign, f"({text})") for sign, text in parts]
    wrapped[0] = ("+", wrapped[0][1])
    assert split_summands(join_summands(wrapped)) == wrapped


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("a - b * (c - d) + -e", [("+", "a"), ("-", "b * (c - d)"), ("+", "-e")]),
        ("-a + b", [("+", "-a"), ("+", "b")]),
        ("a * -b - c^-2", [("+", "a * -b"), ("-", "c^-2")]),
        ("1.0e-3 m - a", [("+", "1.0e-3 m"), ("-", "a")]),
        ("if a > 0 then b - c else d", [("+", "if a > 0 then b - c else d")]),
    ],
)
def test_signs_that_are_no_sums(text: str, wanted: list[tuple[str, str]]) -> None:
    assert split_summands(text) == wanted


def test_no_summand_is_zero() -> None:
    assert join_summands([]) == "0"


def test_the_derivative_of_a_state_is_no_read_of_it_but_follows_its_name() -> None:
    text = "m * der(x) = -k * x + in(x)"
    assert substitute_reads(text, {"x": "y"})[0] == "m * der(x) = -k * y + in(x)"
    assert rename_names(text, {"x": "y"}) == "m * der(y) = -k * y + in(y)"
    assert split_balance(text) == ("m * der(x)", "-k * x + in(x)")
    left, _ = parse_balance(scalar("m * der(x) = x"))
    assert names_in_text("m * der(x)") == ["m"] and len(names(left)) == 2


def test_a_path_a_function_and_a_unit_are_no_names() -> None:
    text = "max(max, m.max) + 3 m * m"
    assert substitute_reads(text, {"max": "q", "m": "r"})[0] == "max(q, m.max) + 3 m * r"
