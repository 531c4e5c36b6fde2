"""Terms: numbers and operations of a Program as z3 has them.

Reals are floating-point numbers: comparisons, signs, abs, min, max and clip are IEEE 754's, NaN
included. What + - * / and functions give is left open: any function of the same operands.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from language.number import LARGEST, NumberType

Range = tuple[float, float]
Limits = Range | frozenset[int]
"""Ends of a real, or the values of a whole number."""


class Terms:
    """Terms of one number type; each new one has a name that no other has."""

    def __init__(self, number: NumberType) -> None:
        import z3

        self.z3 = z3
        self.real = z3.FPSort(*((11, 53) if number == "float64" else (8, 24)))
        self.largest = LARGEST[number]
        self.count = 0
        self.products: dict[int, tuple[Any, Any, Any]] = {}

    def value(self, value: float | int | bool) -> Any:
        """Return a literal."""
        if isinstance(value, bool):
            return self.z3.BoolVal(value)
        return (
            self.z3.FPVal(value, self.real) if isinstance(value, float) else self.z3.IntVal(value)
        )

    def new(self, kind: str, name: str) -> Any:
        """Return what may be any value of its kind: real, truth or whole."""
        self.count += 1
        text = f"{name}!{self.count}"
        if kind == "truth":
            return self.z3.Bool(text)
        return self.z3.Const(text, self.real) if kind == "real" else self.z3.Int(text)

    def within(self, value: Any, limits: Limits) -> Any:
        """Return whether a value is within limits."""
        z3 = self.z3
        if isinstance(limits, frozenset) and z3.is_bool(value):
            return z3.Or(*(value == bool(number) for number in sorted(limits)))
        if isinstance(limits, frozenset):
            return z3.Or(*(value == number for number in sorted(limits)))
        low, high = (self.value(float(end)) for end in limits)
        return z3.And(z3.fpLEQ(low, value), z3.fpLEQ(value, high))

    def minus(self, value: Any) -> Any:
        """Return -x."""
        return self.z3.fpNeg(value) if self.z3.is_fp(value) else -value

    def sum(self, operator: str, left: Any, right: Any) -> Any:
        """Return what + - * / give."""
        if self.z3.is_fp(left):
            made = self.z3.Function(f"real {operator}", self.real, self.real, self.real)(
                left, right
            )
            if operator == "*":
                self.products[made.get_id()] = made, left, right
            return made
        if operator == "/":
            return self.new("whole", "quotient")
        return {"+": left + right, "-": left - right, "*": left * right}[operator]

    def lemmas(self, facts: Collection[Any]) -> list[Any]:
        """Return what is known of the products in some facts: one with a factor that is no larger
        than 1 in size is no larger than the other factor, rounded or not.
        """
        z3 = self.z3
        one, largest = self.value(1.0), self.value(self.largest)
        found, seen, stack = [], set[int](), list(facts)
        while stack:
            part = stack.pop()
            number = part.get_id()
            if number in seen:
                continue
            seen.add(number)
            stack += part.children()
            if number in self.products:
                made, *factors = self.products[number]
                for a, b in (factors, factors[::-1]):
                    is_known = z3.And(z3.fpLEQ(z3.fpAbs(a), one), z3.fpLEQ(z3.fpAbs(b), largest))
                    found.append(z3.Implies(is_known, z3.fpLEQ(z3.fpAbs(made), z3.fpAbs(b))))
        return found

    def compare(self, operator: str, left: Any, right: Any) -> Any:
        """Return a relation; with a NaN it is false, except `!=`."""
        z3 = self.z3
        if operator in ("==", "!="):
            equal = z3.fpEQ(left, right) if z3.is_fp(left) else left == right
            return equal if operator == "==" else z3.Not(equal)
        if z3.is_fp(left):
            of = {"<": z3.fpLT, "<=": z3.fpLEQ, ">": z3.fpGT, ">=": z3.fpGEQ}
            return of[operator](left, right)
        whole = {"<": left < right, "<=": left <= right, ">": left > right, ">=": left >= right}
        return whole[operator]

    def call(self, function: str, given: list[Any]) -> Any:
        """Return what an elementary operation or a function gives."""
        z3, first = self.z3, given[0]
        if function == "whole" or not z3.is_fp(first):
            return self.new("real" if function == "real" else "whole", function)
        match function, given:
            case "abs", _:
                return z3.fpAbs(first)
            case "min", [a, b]:
                return z3.If(z3.fpLT(b, a), b, a)
            case "max", [a, b]:
                return z3.If(z3.fpGT(b, a), b, a)
            case "clip", [x, low, high]:
                return z3.If(z3.fpGT(x, low), z3.If(z3.fpLT(x, high), x, high), low)
            case "within", [x, low, high]:
                return z3.And(z3.fpLEQ(low, x), z3.fpLEQ(x, high))
            case _:
                sorts = [one.sort() for one in given]
                return z3.Function(function, *sorts, self.real)(*given)
