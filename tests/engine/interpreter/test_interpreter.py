"""Interpreter: each operation of a Program means what language/ir/ops.py says, bit for bit."""

from __future__ import annotations

import math
import re
import struct
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, strategies as st

from engine.interpreter.interpreter import Interpreter
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
    Unary,
    add,
    divide,
    integer,
    multiply,
    real,
    subtract,
)
from language.ir.program import Constant, Program, Variable
from language.numerics.function_table import FUNCTIONS

ARITHMETIC = """
1 / 0 = inf; 1 / -0.0 = -inf; -1 / 0 = -inf; -1 / -0.0 = inf; inf / -0.0 = -inf; 0 / 0 = nan;
-0.0 / 0 = nan; nan / 0 = nan; inf / inf = nan; 1 / inf = 0; -1 / inf = -0.0; 0 / -5 = -0.0;
1 / 3 = 0.3333333333333333; 1e308 / 0.01 = inf; 5e-324 / 2 = 0; 5e-324 / -2 = -0.0;
0.1 + 0.2 = 0.30000000000000004; -0.0 + 0 = 0; -0.0 + -0.0 = -0.0; inf + -inf = nan;
1e308 + 1e308 = inf; 0 - 0 = 0; -0.0 - 0 = -0.0; 9007199254740992 - -1 = 9007199254740992;
0 * -5 = -0.0; 0 * inf = nan; 5e-324 * 0.5 = 0; 1e200 * -1e200 = -inf; nan * 0 = nan
"""
CALLS = """
abs(-0.0) = 0; abs(-inf) = inf; abs(nan) = nan; sqrt(-0.0) = -0.0; sqrt(-1) = nan; sqrt(nan) = nan;
sqrt(inf) = inf; sqrt(2) = 1.4142135623730951; min(0, -0.0) = 0; min(-0.0, 0) = -0.0;
min(2, -3) = -3; min(nan, 1) = nan; min(1, nan) = 1; max(0, -0.0) = 0; max(-0.0, 0) = -0.0;
max(2, -3) = 2; max(nan, 1) = nan; max(1, nan) = 1; clip(nan, -1, 1) = -1; clip(5, -1, 1) = 1;
clip(-5, -1, 1) = -1; clip(0.5, -1, 1) = 0.5; clip(0, -0.0, 1) = -0.0; clip(0.5, 1, -1) = 1;
sign(-3) = -1; sign(5e-324) = 1; sign(-0.0) = 0; sign(nan) = 0; pow2(0) = 1; pow2(nan) = nan;
pow2(-1022) = 2.2250738585072014e-308; pow2(1023) = 8.98846567431158e307; sin(-0.0) = -0.0;
sin(nan) = nan; cos(0) = 1; exp(0) = 1; exp(1e300) = 8.218407461554972e307; tanh(-50) = -1
"""
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
            number_type="float64",
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


def run_block(block: Block, **inputs: Any) -> Interpreter:
    """Run a block once and return what is left."""
    stepper = interpreter(go=block)
    for name, value in inputs.items():
        stepper.set(f"input.{name}", value)
    stepper.run("go")
    return stepper


def value_of(expr: Expr, **inputs: Any) -> Any:
    return run_block((Assign(RESULT, expr),), **inputs).get(RESULT)


def bits(value: float) -> str:
    return "nan" if value != value else struct.pack(">d", value).hex()


def both(operator: Any, a: float, b: float) -> float:
    """Return a operator b with variables, and make sure that literals give the same bits."""
    folded = value_of(Binary(operator, real(a), real(b)))
    value: float = value_of(Binary(operator, A, B), a=a, b=b)
    assert bits(folded) == bits(value)
    return value


@pytest.mark.parametrize("line", ARITHMETIC.split(";"))
def test_arithmetic_is_that_of_ieee_754(line: str) -> None:
    a, operator, b, _, result = line.split()
    assert bits(both(operator, float(a), float(b))) == bits(float(result))


def test_operations_keep_their_order_and_round_each_for_itself() -> None:
    assert value_of(add(add(A, B), C), a=1.0, b=1e16, c=-1e16) == 0.0
    assert value_of(add(A, add(B, C)), a=1.0, b=1e16, c=-1e16) == 1.0
    # u * u rounded to 1 + 2^-29: with one rounding for both operations 2^-60 would be left.
    assert value_of(subtract(multiply(A, A), B), a=1.0 + 2.0**-30, b=1.0 + 2.0**-29) == 0.0


@pytest.mark.parametrize("a", [0.0, -0.0, 1.5, -math.inf, 5e-324])
def test_negation_changes_the_sign_alone(a: float) -> None:
    assert bits(value_of(Unary("-", A), a=a)) == bits(-a) == bits(value_of(Unary("-", real(a))))


@pytest.mark.parametrize("operator", ["<", "<=", ">", ">=", "==", "!="])
@pytest.mark.parametrize("other", [math.nan, 0.0, math.inf])
def test_a_relation_with_nan_is_false_but_for_not_equal(operator: Any, other: float) -> None:
    assert value_of(Compare(operator, A, B), a=math.nan, b=other) is (operator == "!=")
    assert value_of(Compare(operator, A, B), a=other, b=math.nan) is (operator == "!=")


def test_not_less_is_not_greater_or_equal() -> None:
    assert value_of(Unary("not", Compare("<", A, B)), a=math.nan, b=1.0) is True
    assert value_of(Compare(">=", A, B), a=math.nan, b=1.0) is False


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
    outside = Item("work.list", integer(99))
    assert value_of(Select(P, A, outside), p=True, a=2.5) == 2.5
    assert value_of(Select(P, outside, A), p=False, a=2.5) == 2.5
    with pytest.raises(IndexError):
        value_of(Select(P, outside, A), p=True)


@pytest.mark.parametrize("line", CALLS.split(";"))
def test_calls_have_the_values_of_the_rules(line: str) -> None:
    function, *texts = re.findall(r"[^ ,()=\n]+", line)
    *arguments, result = map(float, texts)
    places = (A, B, C)[: len(arguments)]
    inputs = dict(zip("abc", arguments, strict=False))
    assert bits(value_of(Call(function, places), **inputs)) == bits(result)
    assert bits(value_of(Call(function, tuple(map(real, arguments))))) == bits(result)


@given(st.floats(allow_nan=False), st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_a_clipped_value_lies_within_its_limits(x: float, low: float, high: float) -> None:
    low, high = min(low, high), max(low, high)
    assert low <= value_of(Call("clip", (A, B, C)), a=x, b=low, c=high) <= high


def test_a_whole_number_becomes_real_by_a_call() -> None:
    block = (Assign("work.i", integer(7)), Assign(RESULT, Call("real", (Ref("work.i"),))))
    assert isinstance(run_block(block).get(RESULT), float)
    assert (
        run_block((*block, Assign(RESULT, divide(A, Ref(RESULT)))), a=1.0).get(RESULT) == 1.0 / 7.0
    )


def test_constants_are_read_and_tunables_stay_tunable() -> None:
    assert value_of(multiply(Ref("constant.k"), Ref("constant.k"))) == 9.0
    stepper = interpreter(go=(Assign(RESULT, multiply(Ref("calibration.c"), real(2.0))),))
    stepper.set("calibration.c", 0.25)
    stepper.run("go")
    assert stepper.get(RESULT) == 0.5


def test_assignments_follow_each_other() -> None:
    left = run_block((Assign("state.x", A), Assign("state.y", add(Ref("state.x"), A))), a=1.0)
    assert (left.get("state.x"), left.get("state.y")) == (1.0, 2.0)


@pytest.mark.parametrize(("p", "result"), [(True, 1.0), (False, 2.0)])
def test_a_branch_runs_one_of_two_blocks(p: bool, result: float) -> None:
    then, other = (Assign(RESULT, real(1.0)),), (Assign(RESULT, real(2.0)),)
    assert run_block((Branch(P, then, other),), p=p).get(RESULT) == result
    assert run_block((Branch(P, then),), p=p).get(RESULT) == (1.0 if p else 0.0)


@pytest.mark.parametrize(("mode", "result"), [(-1, 10.0), (2, 20.0), (3, 0.0)])
def test_a_choice_runs_the_case_of_the_number_or_nothing(mode: int, result: float) -> None:
    cases = tuple((number, (Assign(RESULT, real(x)),)) for number, x in ((-1, 10.0), (2, 20.0)))
    stepper = interpreter(go=(Switch("memory.mode", cases),))
    stepper.set("memory.mode", mode)
    stepper.run("go")
    assert stepper.get(RESULT) == result


def test_a_choice_reads_its_number_once() -> None:
    """As `switch` does: a case that changes the mode does not run that mode's case too."""
    first = (Assign("memory.mode", integer(1)), Assign(RESULT, real(1.0)))
    second = (Assign(RESULT, real(2.0)),)
    left = run_block((Switch("memory.mode", ((0, first), (1, second))),))
    assert (left.get("memory.mode"), left.get(RESULT)) == (1, 1.0)


def test_a_loop_counts_its_index_from_zero_and_arrays_keep_what_is_stored() -> None:
    i, j = Ref("work.i"), Ref("work.j")
    fill = Store("work.list", subtract(integer(3), i), multiply(A, Call("real", (i,))))
    inner = Assign("work.sum", add(Ref("work.sum"), Item("work.list", j)))
    left = run_block(
        (Loop(4, i.name, (fill,)), Loop(2, i.name, (Loop(3, j.name, (inner,)),))), a=1.5
    )
    assert left.get("work.list") == [4.5, 3.0, 1.5, 0.0]
    assert left.get("work.sum") == 2 * (4.5 + 3.0 + 1.5)


def test_arrays_of_two_interpreters_are_not_shared() -> None:
    block: Block = (Store("work.list", integer(0), A),)
    assert run_block(block, a=1.0).get("work.list")[0] == 1.0
    assert run_block(block, a=2.0).get("work.list") == [2.0, 0.0, 0.0, 0.0]


def test_a_counter_saturates_at_its_limit_and_falls_to_zero_at_once() -> None:
    stepper, seen = interpreter(go=(Count("timer.t", P, 3),)), []
    for p in (True, True, False, True, True, True, True, True):
        stepper.set("input.p", p)
        stepper.run("go")
        seen.append(stepper.get("timer.t"))
    assert seen == [1, 2, 0, 1, 2, 3, 3, 3]


def test_fault_bits_are_latched_each_in_its_place() -> None:
    left = run_block((FaultBit("third"), FaultBit("first"), FaultBit("third")))
    assert left.get("memory.faults") == 0b101


def test_blocks_run_blocks_also_those_that_come_later() -> None:
    more = Assign(RESULT, add(Ref(RESULT), real(1.0)))
    stepper = interpreter(
        go=(RunBlock("twice"), more), twice=(RunBlock("once"), RunBlock("once")), once=(more,)
    )
    stepper.run("go")
    assert stepper.get(RESULT) == 3.0


def test_init_runs_after_derive_when_it_is_made() -> None:
    derive = (Assign("derived.d", multiply(Ref("calibration.c"), real(3.0))),)
    stepper = interpreter(init=(Assign("state.x", Ref("derived.d")),), derive=derive)
    assert stepper.get("state.x") == 0.1 * 3.0


def test_variables_start_at_zero_or_false_and_are_read_by_name() -> None:
    stepper = interpreter()
    read = stepper.make_reader(("state.x", "input.p", "memory.mode", "constant.k"))
    assert [repr(value) for value in read()] == ["0.0", "False", "0", "3.0"]
    stepper.set("state.x", 4.0)
    assert read()[0] == 4.0
    assert stepper.has("state.x")
    assert not stepper.has("state.z")
