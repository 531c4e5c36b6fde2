"""Shapes: however operands are read, an expression has the bits that its operations give."""

from __future__ import annotations

import itertools
import math
import struct
from typing import Any

import pytest

from engine.interpreter import expression_closures as shapes
from language.ir.ops import (
    Assign,
    Binary,
    Compare,
    Expr,
    Item,
    Loop,
    Ref,
    Store,
    Unary,
    Value,
    add,
    integer,
    multiply,
    real,
)
from language.numerics.evaluate import evaluate
from tests.engine.interpreter.test_interpreter import RESULT, A, B, C, interpreter, run_block

NUMBERS = {"input.a": 0.1, "input.b": -0.3, "input.c": 7e-17}
TRUTHS = {"input.p": True, "input.q": False}
OPERATORS = tuple(shapes.EXPRESSION_EXPRESSION)


def bits(value: Any) -> bytes:
    return struct.pack(">d", float(value))


def calculated(expr: Expr) -> tuple[bytes, bytes]:
    """Return the bits of the interpreter and of the plain evaluation of a tree."""
    values: dict[str, float | bool] = {**NUMBERS, **TRUTHS}
    short = {name.partition(".")[2]: value for name, value in values.items()}
    return bits(run_block((Assign(RESULT, expr),), **short).get(RESULT)), bits(
        evaluate(expr, values)
    )


def pair(operator: Any, left: Expr, right: Expr) -> Expr:
    if operator in ("+", "-", "*", "/", "and", "or"):
        return Binary(operator, left, right)
    return Compare(operator, left, right)


@pytest.mark.parametrize("operator", OPERATORS)
def test_an_operand_is_read_from_its_place_or_calculated(operator: str) -> None:
    is_truth = operator in ("and", "or")
    p, q = (Ref("input.p"), Ref("input.q")) if is_truth else (A, B)
    sign: Any = "not" if is_truth else "-"
    sides: list[Expr] = [p, q, Unary(sign, p), Unary(sign, q)]
    for left, right in itertools.product(sides, sides):
        ours, expected = calculated(pair(operator, left, right))
        assert ours == expected


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_a_quotient_by_a_zero_is_no_exception_in_any_shape(zero: float) -> None:
    sides: list[tuple[Expr, Expr]] = [(A, B), (Unary("-", A), Unary("-", B))]
    for (left, _), (_, right) in itertools.product(sides, sides):
        expr = Binary("/", left, right)
        ours = run_block((Assign(RESULT, expr),), a=1.0, b=zero).get(RESULT)
        assert bits(ours) == bits(evaluate(expr, {"input.a": 1.0, "input.b": zero}))


@pytest.mark.parametrize(("outer", "inner"), list(shapes.FUSED_LEFT))
def test_operations_on_three_or_four_places_keep_their_order(outer: Any, inner: Any) -> None:
    for a, b, c in itertools.permutations((A, B, C)):
        left, right = pair(inner, a, b), pair(inner, b, c)
        for expr in (pair(outer, left, c), pair(outer, a, right), pair(outer, left, right)):
            ours, expected = calculated(expr)
            assert ours == expected


@pytest.mark.parametrize("x", [-1.1, -1.0, 0.5, 1.0, 1.1, math.nan])
def test_a_range_holds_both_bounds_and_no_nan(x: float) -> None:
    inside = Binary("and", Compare(">=", A, real(-1.0)), Compare("<=", A, real(1.0)))
    left = run_block((Assign("equation.truth", inside),), a=x)
    assert left.get("equation.truth") is (abs(x) <= 1.0)


def test_literals_of_one_value_and_other_types_or_signs_stay_apart() -> None:
    block = (
        Assign("state.x", real(0.0)),
        Assign("state.y", real(-0.0)),
        Assign("work.i", integer(0)),
        Assign("equation.truth", Value(False)),
    )
    left = run_block(block)
    found = [left.get(op.target) for op in block]
    assert [repr(value) for value in found] == ["0.0", "-0.0", "0", "False"]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 9])
def test_assignments_in_a_row_read_what_the_ones_before_them_set(count: int) -> None:
    chain = [Assign("state.x", A), Assign("state.y", Ref("state.x"))]
    chain += [Assign("state.x", add(Ref("state.y"), A)), Assign("state.y", Ref("state.x"))] * count
    assert run_block(tuple(chain), a=1.0).get("state.y") == 1.0 + count


@pytest.mark.parametrize("turns", [3, 20])
def test_a_loop_over_elements_leaves_its_index_at_the_last_turn(turns: int) -> None:
    i, total = Ref("work.i"), Ref("work.sum")
    element = Item("work.list", i if turns == 3 else integer(1))
    body = (Assign(total.name, add(total, multiply(element, A))),)
    fill = tuple(Store("work.list", integer(k), real(10.0**k)) for k in range(3))
    left = run_block((*fill, Loop(turns, i.name, body)), a=2.0)
    assert left.get("work.i") == turns - 1
    assert left.get("work.sum") == (222.0 if turns == 3 else 400.0)


def test_interpreters_of_one_program_have_values_of_their_own() -> None:
    first = interpreter(go=(Store("work.list", integer(0), A), Assign(RESULT, A)))
    second = type(first)(first.program)
    first.set("input.a", 1.0)
    first.run("go")
    assert (second.get("work.list")[0], second.get(RESULT), second.get("input.a")) == (0, 0, 0)
