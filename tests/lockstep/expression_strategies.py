"""Random expressions of a Program as hypothesis strategies: all kinds, all sizes of literals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

from language.ir.ops import (
    Binary,
    Call,
    Compare,
    Expr,
    Select,
    Unary,
    Value,
    add,
    integer,
    multiply,
    real,
    subtract,
)
from language.numerics.sin_cos_tanh import round_to_nearest

Draw = Callable[[st.SearchStrategy[Any]], Any]

SPECIALS = (
    *(0.0, 0.5, 1.0, 2.0, 3.0, 1.0 / 3.0, 0.1, 1e-16, 2.0**-27, 2.0**-53, 0.625, 20.0),
    *(math.pi, math.pi / 2, 1e5, 709.0, 708.0, 2.0**52, 2.0**53, 1e16, 1e22, 1e100),
    *(5e-324, 1e-310, 2.0**-1022, 1e-200, 1e200, 1e308, 1.7976931348623157e308),
)
FINITE: st.SearchStrategy[float] = st.one_of(
    st.sampled_from([sign * x for x in SPECIALS for sign in (1.0, -1.0)]),
    st.integers(-10_000, 10_000).map(lambda n: n / 997.0),
    st.integers(-10_000, 10_000).map(lambda n: n / 997.0),
    st.floats(allow_nan=False, allow_infinity=False),
)
"""Literals: what a spec may hold."""
ANY: st.SearchStrategy[float] = st.one_of(
    FINITE, st.sampled_from([math.nan, math.inf, -math.inf, -0.0])
)
"""Inputs: what a sensor may send."""

REALS = (
    *("leaf", "+", "+", "-", "-", "*", "*", "/", "/", "negative", "select", "select"),
    *("sum of product", "sum of product", "sum of product"),
    *("abs", "sqrt", "min", "max", "clip", "sign", "sin", "cos", "exp", "tanh", "pow2", "count"),
    *("floor", "tan", "atan2", "rounded", "log", "pow"),
)
TRUTHS = ("leaf", "compare", "compare", "compare", "whole", "same", "not", "and", "or", "select")
RELATIONS = ("<", "<=", ">", ">=", "==", "!=")


@dataclass(frozen=True)
class Scope:
    """What may be read at one place, by type; `counters` are (variable, largest literal)."""

    reals: tuple[Expr, ...]
    truths: tuple[Expr, ...] = ()
    counters: tuple[tuple[Expr, int], ...] = ()

    def with_reals(self, *reals: Expr) -> Scope:
        """Return the scope with more real values to read."""
        return Scope((*self.reals, *reals), self.truths, self.counters)


@st.composite
def reals(draw: Draw, scope: Scope, depth: int) -> Expr:
    """Return a real expression at most `depth` operations deep."""
    kind = draw(st.sampled_from(REALS)) if depth else "leaf"

    def part() -> Expr:
        found: Expr = draw(reals(scope, depth - 1))
        return found

    match kind:
        case "leaf":
            known = draw(st.integers(0, len(scope.reals)))
            return scope.reals[known - 1] if known else real(draw(FINITE))
        case "+" | "-" | "*" | "/":
            return Binary(kind, part(), part())
        case "sum of product":
            # What a compiler contracts to one rounding if it may (rule C3).
            sides = (multiply(part(), part()), part())
            return Binary(draw(st.sampled_from(("+", "-"))), *draw(st.permutations(sides)))
        case "negative":
            return Unary("-", part())
        case "select":
            return Select(draw(truths(scope, depth - 1)), part(), part())
        case "min" | "max" | "atan2" | "pow":
            return Call(kind, (part(), part()))
        case "clip":
            return Call(kind, (part(), part(), part()))
        case "pow2":
            # A whole number within its domain, as the functions of ha_math call it; NaN is low.
            bounded = Call("clip", (part(), real(-1022.0), real(1023.0)))
            return Call(kind, (round_to_nearest(bounded),))
        case "rounded":
            return Call("real", (Call("whole", (Call("floor", (part(),)),)),))
        case "count":
            return Call("real", (draw(wholes(scope)),))
        case _:
            return Call(kind, (part(),))


@st.composite
def truths(draw: Draw, scope: Scope, depth: int) -> Expr:
    """Return a truth value at most `depth` operations deep."""
    kind = draw(st.sampled_from(TRUTHS)) if depth > 0 else "leaf"

    def part() -> Expr:
        found: Expr = draw(truths(scope, depth - 1))
        return found

    match kind:
        case "compare":
            relation = draw(st.sampled_from(RELATIONS))
            return Compare(relation, draw(reals(scope, depth - 1)), draw(reals(scope, depth - 1)))
        case "whole" if scope.counters:
            counter, largest = draw(st.sampled_from(scope.counters))
            relation = draw(st.sampled_from(RELATIONS))
            return Compare(relation, counter, integer(draw(st.integers(1, largest))))
        case "same" if len(scope.truths) > 1:
            # A C compiler warns of `q == q`, and of comparisons with true and false.
            sides = draw(st.permutations(scope.truths))[:2]
            return Compare(draw(st.sampled_from(RELATIONS[4:])), sides[0], sides[1])
        case "not":
            return Unary("not", part())
        case "and" | "or":
            return Binary(kind, part(), part())
        case "select" if scope.truths:
            return Select(part(), draw(st.sampled_from(scope.truths)), part())
        case _:
            known = draw(st.integers(0, len(scope.truths)))
            return scope.truths[known - 1] if known else Value(draw(st.booleans()))


@st.composite
def wholes(draw: Draw, scope: Scope) -> Expr:
    """Return a whole number: a counter times a literal, plus or minus a literal."""
    number = integer(draw(st.integers(-1000, 1000)))
    if not scope.counters:
        return number
    counter, _ = draw(st.sampled_from(scope.counters))
    combine = draw(st.sampled_from([add, subtract]))
    result: Expr = combine(multiply(counter, integer(draw(st.integers(-30, 30)))), number)
    return result
