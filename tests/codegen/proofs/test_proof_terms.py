"""Terms: what z3 is told of operations is what the engine does, NaN and infinities included."""

from __future__ import annotations

import itertools
import math
from random import Random
from typing import Any

import pytest

from codegen.proofs.infeasible.float_terms import Real, Terms
from language.ir.number_type import MAX_FINITE, NumberType, round_to_type
from language.numerics.evaluate import BINARY_OPERATIONS, ELEMENTARY_BY_TYPE

NUMBERS: tuple[NumberType, ...] = ("float64", "float32")
SOME = (0.0, -0.0, 1.0, -1.5, 3.0, 1e30)
TABLES, POINTS, TRIES = 40, 4, 12


def truth(terms: Terms, term: Any) -> bool:
    found = terms.z3.simplify(term)
    assert terms.z3.is_true(found) or terms.z3.is_false(found), found
    return bool(terms.z3.is_true(found))


def real(terms: Terms, value: float) -> Real:
    made = terms.value(0.0 if math.isnan(value) else value)
    assert isinstance(made, Real)
    return Real(made.value, terms.z3.BoolVal(math.isnan(value)))


@pytest.mark.parametrize("number", NUMBERS)
def test_comparisons_and_what_is_made_of_them(number: NumberType) -> None:
    terms = Terms(number)
    for a, b in itertools.product((*SOME, math.nan), repeat=2):
        x, y = real(terms, a), real(terms, b)
        for operator in ("<", "<=", ">", ">=", "==", "!="):
            assert truth(terms, terms.compare(operator, x, y)) == BINARY_OPERATIONS[operator](a, b)
        for name in ("min", "max"):
            same(terms, terms.call(name, [x, y]), ELEMENTARY_BY_TYPE[number][name](a, b))
        same(terms, terms.call("abs", [x]), abs(a))
        same(terms, terms.minus(x), -a)
        held = terms.call("clip", [x, real(terms, -1.0), real(terms, 2.0)])
        same(terms, held, ELEMENTARY_BY_TYPE[number]["clip"](a, -1.0, 2.0))


def same(terms: Terms, found: Real, wanted: float) -> None:
    assert truth(terms, found.nan) == math.isnan(wanted)
    if not math.isnan(wanted):
        assert truth(terms, found.value == real(terms, wanted).value)


@pytest.mark.long
@pytest.mark.parametrize("number", NUMBERS)
def test_a_table_gives_what_lies_within_its_bounds(number: NumberType) -> None:
    draw = Random(number)
    for _ in range(TABLES):
        axis = sorted({round_to_type(draw.uniform(-9, 9), number) for _ in range(POINTS)})
        values = [
            round_to_type(draw.choice((1.0, 0.1, 1e-3)) * draw.uniform(-9, 9), number) for _ in axis
        ]
        terms = Terms(number)
        x = terms.new("real", "x")
        (bound,) = terms.lemmas([terms.looked_up(values, x).value])
        for _ in range(TRIES):
            at = draw.choice((*axis, draw.uniform(-10, 10), math.nextafter(axis[-1], -math.inf)))
            seen = round_to_type(
                ELEMENTARY_BY_TYPE[number]["lookup"](
                    axis, len(axis), values, round_to_type(at, number)
                ),
                number,
            )
            assert not is_refuted(terms, bound, x, at, seen)


def is_refuted(terms: Terms, bound: Any, x: Real, at: float, seen: float) -> bool:
    """Tell whether a bound says that a value is impossible."""
    solver = terms.z3.Solver()
    found = terms.z3.Real("lookup!2")
    solver.add(bound, terms.z3.Not(x.nan), x.value == real(terms, at).value)
    solver.add(found == real(terms, seen).value)
    return bool(solver.check() == terms.z3.unsat)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_product_with_a_part_is_no_larger(number: NumberType) -> None:
    draw, terms = Random(f"product {number}"), Terms(number)
    for _ in range(TABLES):
        part = round_to_type(draw.choice((1.0, -1.0, draw.uniform(-1, 1), 1e-40)), number)
        whole = round_to_type(
            draw.choice((MAX_FINITE[number], 0.0, draw.uniform(-1e9, 1e9))), number
        )
        product = terms.sum("*", real(terms, part), real(terms, whole))
        seen = real(terms, round_to_type(part * whole, number))
        solver = terms.z3.Solver()
        solver.add(*terms.lemmas([product.value]), product.value == seen.value)
        solver.add(product.nan == seen.nan)
        assert solver.check() == terms.z3.sat


def test_the_two_zeros_are_no_same_operands() -> None:
    terms = Terms("float64")
    one, plus, minus = (terms.value(value) for value in (1.0, 0.0, -0.0))
    assert truth(terms, terms.compare("==", plus, minus))
    assert terms.sum("/", one, plus) is not terms.sum("/", one, minus)


def test_the_same_operands_give_the_same() -> None:
    terms = Terms("float64")
    x, y = terms.new("real", "x"), terms.new("real", "y")
    assert terms.sum("+", x, y) is terms.sum("+", x, y)
    assert terms.sum("+", x, y) is not terms.sum("+", y, x)
    assert terms.call("exp", [x]) is terms.call("exp", [x])
