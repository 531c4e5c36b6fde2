"""Floating-point terms: numbers and operations of a Program as terms of z3.

A real is a real number and a flag for NaN. Comparisons, signs, abs, min, max and clip depend only
on the order of numbers, and infinities are two numbers beyond all others. Results of + - * / and of
functions are uninterpreted: equal for equal operands. Two facts are added: a product with a factor
of magnitude at most 1 is no larger than the other factor, and a table value lies between its
smallest and largest value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import copysign, isfinite
from typing import Any

from language.ir.number_type import MAX_FINITE, NumberType, round_to_type

BEFORE_ONE = {"float64": 1.0 - 2.0**-53, "float32": 1.0 - 2.0**-24}
"""The largest number below 1 by number type."""
Range = tuple[float, float]
Limits = Range | frozenset[int]
"""The ends of the range of a real, or the values of a whole number."""


@dataclass(frozen=True)
class Real:
    """A real: its value as a real number, and whether it is NaN."""

    value: Any
    nan: Any


class Terms:
    """A factory of terms for one number type; each new variable has a unique name."""

    def __init__(self, number: NumberType) -> None:
        import z3

        self.z3 = z3
        self.number = number
        self.count = 0
        self.bounds: dict[int, list[Any]] = {}
        self.known: dict[tuple[object, ...], tuple[Any, object]] = {}
        self.limited: dict[tuple[object, ...], tuple[Any, object]] = {}

    def value(self, value: float | int | bool) -> Any:
        """Return a literal; -0 is another term than 0, because 1 / -0 is another number."""
        z3 = self.z3
        if isinstance(value, bool):
            return z3.BoolVal(value)
        if not isinstance(value, float):
            return z3.IntVal(value)
        number = round_to_type(value, self.number)
        if not isfinite(number):
            return self.new("real", "literal")
        found = Real(z3.RealVal(str(Fraction(abs(number)))), z3.BoolVal(False))
        return self.minus(found) if copysign(1.0, number) < 0.0 else found

    def number_of(self, value: Any) -> int | None:
        """Return the value of a whole-number or truth literal, a truth value as 0 or 1."""
        z3 = self.z3
        if isinstance(value, Real):
            return None
        if z3.is_int_value(value):
            return int(value.as_long())
        return 1 if z3.is_true(value) else 0 if z3.is_false(value) else None

    def new(self, kind: str, name: str) -> Any:
        """Return an unconstrained variable of a kind: real, truth or whole."""
        z3 = self.z3
        self.count += 1
        text = f"{name}!{self.count}"
        if kind == "truth":
            return z3.Bool(text)
        return Real(z3.Real(text), z3.Bool(f"{text} is NaN")) if kind == "real" else z3.Int(text)

    def choose(self, test: Any, then: Any, other: Any) -> Any:
        """Return a choice between two values of the same kind."""
        if isinstance(then, Real):
            values = self.z3.If(test, then.value, other.value)
            return Real(values, self.z3.If(test, then.nan, other.nan))
        return self.z3.If(test, then, other)

    def within(self, value: Any, limits: Limits) -> Any:
        """Return the predicate that a value is within limits.

        Equal arguments give the same term.
        """
        key = (*(part.get_id() for part in _parts(value)), limits)
        if key not in self.limited:
            self.limited[key] = self._within(value, limits), value  # a value keeps its numbers
        return self.limited[key][0]

    def _within(self, value: Any, limits: Limits) -> Any:
        z3 = self.z3
        if isinstance(limits, frozenset) and z3.is_bool(value):
            return z3.Or(*(value if number else z3.Not(value) for number in sorted(limits)))
        if isinstance(limits, frozenset):
            return z3.Or(*(value == number for number in sorted(limits)))
        if not isinstance(value, Real):
            return z3.And(value >= int(limits[0]), value <= int(limits[1]))
        low, high = (self.value(float(end)) for end in limits)
        return z3.And(z3.Not(value.nan), low.value <= value.value, value.value <= high.value)

    def minus(self, value: Any) -> Any:
        """Return -x."""
        return Real(-value.value, value.nan) if isinstance(value, Real) else -value

    def sum(self, operator: str, left: Any, right: Any) -> Any:
        """Return the result of + - * or /."""
        if isinstance(left, Real):
            made = self._left_open(operator, (left, right), "real")
            if operator == "*":
                self._bound(made, left, right)
                self._bound(made, right, left)
            return made
        if operator == "/":
            return self.new("whole", "quotient")
        return {"+": left + right, "-": left - right, "*": left * right}[operator]

    def _bound(self, product: Real, factor: Real, other: Real) -> None:
        """A product with a factor of at most 1 is no larger than the other one, rounded or not."""
        z3 = self.z3
        small = z3.And(self._is_finite(factor), factor.value <= 1, factor.value >= -1)
        size = self._size(other).value
        is_bound = z3.And(z3.Not(product.nan), product.value <= size, product.value >= -size)
        bound = z3.Implies(z3.And(small, self._is_finite(other)), is_bound)
        self.bounds.setdefault(product.value.get_id(), []).append(bound)

    def lemmas(self, facts: Sequence[Any]) -> list[Any]:
        """Return the known facts on the products and table values that occur in some facts."""
        found: list[Any] = []
        seen, stack = set[int](), list(facts if self.bounds else ())
        while stack:
            part = stack.pop()
            number = part.get_id()
            if number not in seen:
                seen.add(number)
                bounds = self.bounds.get(number, [])
                found += bounds
                stack += [*part.children(), *bounds]
        return found

    def _is_finite(self, x: Real) -> Any:
        largest = self.value(MAX_FINITE[self.number]).value
        return self.z3.And(self.z3.Not(x.nan), -largest <= x.value, x.value <= largest)

    def compare(self, operator: str, left: Any, right: Any) -> Any:
        """Return a comparison; with a NaN it is false, except `!=`."""
        z3 = self.z3
        if operator == "!=":
            return z3.Not(self.compare("==", left, right))
        a, b = (one.value if isinstance(one, Real) else one for one in (left, right))
        found = {"==": a == b, "<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b}[operator]
        if isinstance(left, Real):
            return z3.And(z3.Not(left.nan), z3.Not(right.nan), found)
        return found

    def call(self, function: str, given: list[Any]) -> Any:
        """Return the result of an elementary operation or a function."""
        first = given[0]
        if function == "whole" or not isinstance(first, Real):
            return self.new("real" if function == "real" else "whole", function)
        match function, given:
            case "abs", _:
                return self._size(first)
            case "min", [a, b]:
                return self.choose(self.compare("<", b, a), b, a)
            case "max", [a, b]:
                return self.choose(self.compare(">", b, a), b, a)
            case "clip", [x, low, high]:
                inside = self.choose(self.compare("<", x, high), x, high)
                return self.choose(self.compare(">", x, low), inside, low)
            case "within", [x, low, high]:
                return self.z3.And(self.compare("<=", low, x), self.compare("<=", x, high))
            case _:
                return self._left_open(function, given, "real")

    def looked_up(self, points: Sequence[float], x: Real) -> Real:
        """Return the result of a table lookup.

        Rounding is monotonic, so the result lies between the values at the ends of a cell, with a
        rounding error just before the ends.
        """
        z3, found = self.z3, self.new("real", "lookup")
        ends = list(points)
        for a, b in pairwise(points):
            apart = round_to_type(b - a, self.number)
            step = round_to_type(BEFORE_ONE[self.number] * apart, self.number)
            ends.append(round_to_type(a + step, self.number))
        low, high = self.value(min(ends)).value, self.value(max(ends)).value
        within = z3.And(z3.Not(found.nan), low <= found.value, found.value <= high)
        bound = z3.Implies(z3.Not(x.nan), within)
        self.bounds.setdefault(found.value.get_id(), []).append(bound)
        return Real(found.value, found.nan)

    def _size(self, x: Real) -> Real:
        return Real(self.z3.If(x.value < 0, -x.value, x.value), x.nan)

    def _left_open(self, name: str, given: Sequence[Any], kind: str) -> Any:
        """Return what may be anything, but the same for the same operands."""
        parts = [part for one in given for part in _parts(one)]
        key = (name, *(part.get_id() for part in parts))
        if key not in self.known:
            self.known[key] = self.new(kind, name), parts  # parts keep their numbers
        return self.known[key][0]


def _parts(value: Any) -> tuple[Any, ...]:
    """Return the terms of z3 that a value has."""
    return (value.value, value.nan) if isinstance(value, Real) else (value,)
