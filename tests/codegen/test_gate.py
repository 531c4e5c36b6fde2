"""Gate: what C takes at once is what the Program takes one by one."""

from __future__ import annotations

import math

import pytest

from codegen.gate import APART, LATCH, centred, gated
from codegen.source import c_files
from language.evaluate import evaluate
from language.operation import Binary, Branch, Call, Compare, Expr, Ref, Run, Value
from modewright.api import program as shipped
from tests.language.making import program

X = Ref("x")
KEYS = """language: 1
automaton: keys
period: 10 ms
numbers: float64
inputs: {key: {type: enum, values: [parked, ready]}, level: {type: int, range: [0, 9]}}
initial: low
modes: {low: {transitions: {high: {when: key == ready and level > 2}}}, high: {}}
outputs: [mode]
"""


def between(low: float, high: float) -> Expr:
    return Binary("and", Compare(">=", X, Value(low)), Compare("<=", X, Value(high)))


@pytest.mark.parametrize("x", [0.0, -0.0, 2.0, -2.0, 5e-324, math.inf, -math.inf, math.nan])
def test_one_comparison_says_what_two_said(x: float) -> None:
    for value in (x, math.nextafter(x, math.inf), math.nextafter(x, -math.inf)):
        test = between(-2.0, 2.0)
        assert centred(test) == Compare("<=", Call("abs", (X,)), Value(2.0))
        assert evaluate(centred(test), {"x": value}) == evaluate(test, {"x": value})


@pytest.mark.parametrize(("low", "high"), [(-2.0, 3.0), (0.0, 2.0), (2.0, 2.0), (2.0, -2.0)])
def test_other_ranges_stay_two_comparisons(low: float, high: float) -> None:
    assert centred(between(low, high)) == between(low, high)


def test_inputs_are_taken_at_once_or_each_apart() -> None:
    made = shipped("estimator")
    blocks = gated(made).blocks
    (taken,) = blocks[LATCH]
    assert isinstance(taken, Branch)
    assert len(taken.then) == len(blocks[APART]) == len(made.blocks[LATCH]) > 1
    assert taken.other == (Run(APART),)


def test_a_word_of_an_enumeration_is_not_asked_whether_it_is_below_0() -> None:
    """It is unsigned in C: gcc -Wextra warns of such a comparison."""
    made = program(KEYS)
    text = c_files(made)["keys.c"]
    assert text.count("in->key <= keys_key_ready") == text.count("in->level <= 9") == 2
    assert text.count("in->level >= 0") == 2
    assert ">= keys_key" not in text
