"""Formula names: the identifiers of hoisted values say what they are."""

from __future__ import annotations

import pytest

from language.ir.formula_name import FALLBACK_NAME, formula_name
from language.ir.ops import Binary, Call, Compare, Expr, Ref, Unary, Value

A, W = Ref("input.a"), Ref("state.at_w")


@pytest.mark.parametrize(
    ("expr", "name"),
    [
        (Unary("not", A), "not_a"),
        (Unary("-", A), "minus_a"),
        (Unary("not", Call("is_new", (A,))), "not_is_new_a"),
        (Binary("*", W, W), "w_squared"),
        (Binary("/", Value(1.0), W), "per_w"),
        (Binary("*", Value(0.5), Unary("-", W)), "half_minus_w"),
        (Unary("not", Compare("<", A, W)), FALLBACK_NAME),
        (Binary("and", A, W), FALLBACK_NAME),
    ],
)
def test_a_name_reads_like_its_expression(expr: Expr, name: str) -> None:
    assert formula_name(expr) == name
