"""Interpreter: each operation of a Program means what language/program.py says, bit for bit."""

from __future__ import annotations

import math
import struct
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, strategies as st

from engine.interpreter import Interpreter
from language.elementary import FUNCTIONS
from language.program import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Choose,
    Compare,
    Constant,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Program,
    Ref,
    Run,
    Select,
    Store,
    Unary,
    Value,
    Variable,
    add,
    divide,
    multiply,
    real,
    subtract,
    whole,
)

INF, NAN, LARGEST, LEAST = math.inf, math.nan, 1.7976931348623157e308, 5e-324
A, B, C, RESULT = Ref("input.a"), Ref("input.b"), Ref("input.c"), "equation.result"
P, Q = Ref("input.p"), Ref("input.q")
REALS = ("input.a", "input.b", "input.c", RESULT, "state.x", "state.y", "work.sum")
WHOLES = ("memory.mode", "memory.faults", "timer.t", "work.i", "work.j")


def interpreter(**blocks: Block) -> Interpreter:
    variables = [Variable(name, "real") for name in REALS]
    variables += [Variable(name, "whole") for name in WHOLES]
    variables += [Variable(name, "truth") for name in ("input.p", "input.q", "equation.truth")]
    variables += [Variable("work.list", "real", size=4)]
    return Interpreter(
        Program(
            name="trial",
            number="float64",
            period=Fraction(1, 100),
            major_step=Fraction(1, 100),
            constants=(
                Constant("constant.k", "fixed", 3.0),
                Constant("calibration.c", "tunable", 0.1),
                Constant("derived.d", "derived", 0.0),
            ),
            variables=tuple(variables),
            outputs=(),
            modes=(),
            transitions=(),
            faults=("first", "second", "third"),
            functions=tuple(FUNCTIONS.values()),
            blocks=blocks,
        )
    )


def after(block: Block, **inputs: Any) -> Interpreter:
    """Run a block once and return what is left."""
    stepper = interpreter(go=block)
    for name, value in inputs.items():
        stepper.set(f"input.{name}", value)
    stepper.run("go")
    return stepper


def value_of(expr: Expr, **inputs: Any) -> Any:
    return after((Assign(RESULT, expr),), **inputs).get(RESULT)


def bits(value: float) -> str:
    return "nan" if value != value else struct.pack(">d", value).hex()


def both(operator: Any, a: float, b: float) -> float:
    """Return a operator b with variables, and make sure that literals give the same bits."""
    folded = value_of(Binary(operator, real(a), real(b)))
    value: float = value_of(Binary(operator, A, B), a=a, b=b)
    assert bits(folded) == bits(value)
    return value


@pytest.mark.parametrize(
    ("a", "b", "quotient"),
    [
        (1.0, 0.0, INF),
        (1.0, -0.0, -INF),
        (-1.0, 0.0, -INF),
        (-1.0, -0.0, INF),
        (INF, -0.0, -INF),
        (0.0, 0.0, NAN),
        (-0.0, 0.0, NAN),
        (NAN, 0.0, NAN),
        (INF, INF, NAN),
        (1.0, INF, 0.0),
        (-1.0, INF, -0.0),
        (0.0, -5.0, -0.0),
        (1.0, 3.0, 0.3333333333333333),
        (LARGEST, 0.5, INF),
        (LEAST, 2.0, 0.0),
        (LEAST, -2.0, -0.0),
    ],
)
def test_division_is_that_of_ieee_754(a: float, b: float, quotient: float) -> None:
    assert bits(both("/", a, b)) == bits(quotient)


@pytest.mark.parametrize(
    ("operator", "a", "b", "result"),
    [
        ("+", 0.1, 0.2, 0.30000000000000004),
        ("+", -0.0, 0.0, 0.0),
        ("+", -0.0, -0.0, -0.0),
        ("+", INF, -INF, NAN),
        ("+", LARGEST, LARGEST, INF),
        ("-", 0.0, 0.0, 0.0),
        ("-", -0.0, 0.0, -0.0),
        ("-", 2.0**53, -1.0, 2.0**53),
        ("*", 0.0, -5.0, -0.0),
        ("*", 0.0, INF, NAN),
        ("*", LEAST, 0.5, 0.0),
        ("*", 1e200, -1e200, -INF),
    ],
)
def test_arithmetic_is_that_of_ieee_754(operator: str, a: float, b: float, result: float) -> None:
    assert bits(both(operator, a, b)) == bits(result)


def test_operations_keep_their_order_and_round_each_for_itself() -> None:
    assert value_of(add(add(A, B), C), a=1.0, b=1e16, c=-1e16) == 0.0
    assert value_of(add(A, add(B, C)), a=1.0, b=1e16, c=-1e16) == 1.0
    # u * u rounded to 1 + 2^-29: with one rounding for both operations 2^-60 would be left.
    assert value_of(subtract(multiply(A, A), B), a=1.0 + 2.0**-30, b=1.0 + 2.0**-29) == 0.0


@pytest.mark.parametrize("a", [0.0, -0.0, 1.5, -INF, LEAST])
def test_negation_changes_the_sign_alone(a: float) -> None:
    assert bits(value_of(Unary("-", A), a=a)) == bits(-a) == bits(value_of(Unary("-", real(a))))


@pytest.mark.parametrize("operator", ["<", "<=", ">", ">=", "==", "!="])
@pytest.mark.parametrize("other", [NAN, 0.0, INF])
def test_a_relation_with_nan_is_false_but_for_not_equal(operator: Any, other: float) -> None:
    assert value_of(Compare(operator, A, B), a=NAN, b=other) is (operator == "!=")
    assert value_of(Compare(operator, A, B), a=other, b=NAN) is (operator == "!=")


def test_not_less_is_not_greater_or_equal() -> None:
    assert value_of(Unary("not", Compare("<", A, B)), a=NAN, b=1.0) is True
    assert value_of(Compare(">=", A, B), a=NAN, b=1.0) is False


def test_both_zeros_are_equal_and_neither_is_less() -> None:
    assert value_of(Compare("==", A, B), a=-0.0, b=0.0) is True
    assert value_of(Compare("<", A, B), a=-0.0, b=0.0) is False


@pytest.mark.parametrize("p", [False, True])
@pytest.mark.parametrize("q", [False, True])
def test_and_and_or_of_truth_values(p: bool, q: bool) -> None:
    assert value_of(Binary("and", P, Q), p=p, q=q) is (p and q)
    assert value_of(Binary("or", P, Q), p=p, q=q) is (p or q)
    assert value_of(Compare("!=", P, Q), p=p, q=q) is (p != q)


def test_a_selection_evaluates_the_chosen_side_only() -> None:
    outside = Item("work.list", whole(99))
    assert value_of(Select(P, A, outside), p=True, a=2.5) == 2.5
    assert value_of(Select(P, outside, A), p=False, a=2.5) == 2.5
    with pytest.raises(IndexError):
        value_of(Select(P, outside, A), p=True)


CALLS: list[tuple[str, tuple[float, ...], float]] = [
    ("abs", (-0.0,), 0.0),
    ("abs", (-INF,), INF),
    ("sqrt", (-0.0,), -0.0),
    ("sqrt", (-1.0,), NAN),
    ("sqrt", (NAN,), NAN),
    ("sqrt", (INF,), INF),
    ("sqrt", (2.0,), 1.4142135623730951),
    ("min", (0.0, -0.0), 0.0),
    ("min", (-0.0, 0.0), -0.0),
    ("min", (NAN, 1.0), NAN),
    ("min", (1.0, NAN), 1.0),
    ("max", (0.0, -0.0), 0.0),
    ("max", (NAN, 1.0), NAN),
    ("max", (1.0, NAN), 1.0),
    ("clip", (NAN, -1.0, 1.0), -1.0),
    ("clip", (5.0, -1.0, 1.0), 1.0),
    ("clip", (-5.0, -1.0, 1.0), -1.0),
    ("clip", (0.0, -0.0, 1.0), -0.0),
    ("clip", (0.5, 1.0, -1.0), 1.0),
    ("sign", (-3.0,), -1.0),
    ("sign", (LEAST,), 1.0),
    ("sign", (-0.0,), 0.0),
    ("sign", (NAN,), 0.0),
    ("pow2", (-1022.0,), 2.0**-1022),
    ("pow2", (1023.0,), 2.0**1023),
    ("pow2", (NAN,), NAN),
    ("sin", (-0.0,), -0.0),
    ("cos", (0.0,), 1.0),
    ("exp", (1e300,), math.exp(709.0)),
    ("tanh", (-50.0,), -1.0),
    ("tanh", (NAN,), NAN),
]


@pytest.mark.parametrize(("function", "arguments", "result"), CALLS)
def test_calls(function: str, arguments: tuple[float, ...], result: float) -> None:
    inputs = dict(zip("abc", arguments, strict=False))
    places = (A, B, C)[: len(arguments)]
    assert bits(value_of(Call(function, places), **inputs)) == bits(result)
    literals = tuple(real(argument) for argument in arguments)
    assert bits(value_of(Call(function, literals))) == bits(result)


@given(st.floats(allow_nan=False), st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_a_clipped_value_lies_within_its_limits(x: float, low: float, high: float) -> None:
    low, high = min(low, high), max(low, high)
    assert low <= value_of(Call("clip", (A, B, C)), a=x, b=low, c=high) <= high


def test_a_whole_number_becomes_real_by_a_call() -> None:
    block = (Assign("work.i", whole(7)), Assign(RESULT, Call("real", (Ref("work.i"),))))
    assert isinstance(after(block).get(RESULT), float)
    assert after((*block, Assign(RESULT, divide(A, Ref(RESULT)))), a=1.0).get(RESULT) == 1.0 / 7.0


def test_constants_are_read_and_tunables_stay_tunable() -> None:
    assert value_of(multiply(Ref("constant.k"), Ref("constant.k"))) == 9.0
    stepper = interpreter(go=(Assign(RESULT, multiply(Ref("calibration.c"), real(2.0))),))
    stepper.set("calibration.c", 0.25)
    stepper.run("go")
    assert stepper.get(RESULT) == 0.5
