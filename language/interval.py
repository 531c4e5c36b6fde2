"""Interval: what values an expression can have, from the ranges that are declared.

An interval is known where every name in it has a declared range. What is not known never gives a
problem: bounds are then only used where a function or an `if` gives them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from language.syntax import (
    TIMES,
    Application,
    Arithmetic,
    Choice,
    Likeness,
    Logic,
    Name,
    Negative,
    Not,
    Number,
    Power,
    Relation,
    Tree,
    alike,
    children,
)

OPPOSITE = {"<": ">=", "<=": ">", ">": "<=", ">=": "<"}
MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}


@dataclass(frozen=True)
class Interval:
    """All values from `low` to `high`; `known` if they follow from declared ranges alone."""

    low: float = -math.inf
    high: float = math.inf
    known: bool = False

    @property
    def meets_zero(self) -> bool:
        """Tell whether 0 is among the values."""
        return self.low <= 0.0 <= self.high

    def within(self, other: Interval) -> Interval:
        """Return the part that lies in another one too."""
        return Interval(max(self.low, other.low), min(self.high, other.high), self.known)

    def joined(self, other: Interval) -> Interval:
        """Return what holds the values of both."""
        known = self.known and other.known
        return Interval(min(self.low, other.low), max(self.high, other.high), known)


ANYTHING = Interval()
Limits = Mapping[object, Interval]
"""What enclosing conditions say of expressions, by the number of what is written alike."""
NO_LIMITS: Limits = {}
Look = Callable[[str], Interval]
Report = Callable[[str, Tree, Interval], None]


class Ranging:
    """Finds intervals; `look` gives those of names, `report` takes divisors and roots.

    A quiet one has no `report`: what conditions say is not looked into, only what they exclude.
    """

    def __init__(
        self, look: Look, table: Look, likeness: Likeness, report: Report | None = None
    ) -> None:
        """Know the names; `likeness` numbers the expressions that limits are about."""
        self.look = look
        self.table = table
        self.likeness = likeness
        self.report = report
        self.quiet = Ranging(look, table, likeness) if report else self
        self.bounds: dict[tuple[int, int], tuple[Limits, Interval]] = {}

    def expression(self, tree: Tree) -> Interval:
        """Return the interval of an expression, reporting what is outside a domain inside it."""
        self.quiet.bounds.clear()
        return self.of(tree, NO_LIMITS)

    def of(self, tree: Tree, limits: Limits) -> Interval:
        """Return the interval of a part of an expression within the limits that hold there."""
        if isinstance(tree, Relation | Logic | Not):
            if self.report:
                for part in children(tree):
                    self.of(part, limits)
            return ANYTHING
        found = self._of(tree, limits)
        held = limits.get(self.likeness.number(tree)) if limits else None
        return found.within(held) if held else found

    def _of(self, tree: Tree, limits: Limits) -> Interval:
        match tree:
            case Number(value, _, _):
                return Interval(float(value), float(value), True)
            case Name(path, _):
                return self.look(path)
            case Negative(operand, _):
                inner = self.of(operand, limits)
                return Interval(-inner.high, -inner.low, inner.known)
            case Arithmetic():
                return self._arithmetic(tree, limits)
            case Power(base, exponent, _):
                inner = self.of(base, limits)
                if exponent < 0 and inner.meets_zero and self._excluded(base, limits):
                    return ANYTHING
                return self._power(tree, inner, exponent)
            case Choice(condition, then, other, _):
                if self.report:
                    self.of(condition, limits)
                held = self.of(then, self._limited(condition, True, limits))
                return held.joined(self.of(other, self._limited(condition, False, limits)))
            case Application():
                return self._application(tree, limits)
        return ANYTHING

    def _arithmetic(self, tree: Arithmetic, limits: Limits) -> Interval:
        left, right = self.of(tree.left, limits), self.of(tree.right, limits)
        known = left.known and right.known
        match tree.operator:
            case "+":
                return Interval(left.low + right.low, left.high + right.high, known)
            case "-":
                return Interval(left.low - right.high, left.high - right.low, known)
            case "*":
                if alike(tree.left, tree.right):
                    return _even(left, 2)
                return _corners(left, right, lambda a, b: a * b)
        if right.meets_zero:
            if self.report and not self._excluded(tree.right, limits):
                self.report("divisor", tree.right, right)
            return ANYTHING
        return _corners(left, right, lambda a, b: a / b)

    def _power(self, tree: Power, base: Interval, exponent: int) -> Interval:
        if exponent < 0 and base.meets_zero:
            if self.report:
                self.report("divisor", tree.base, base)
            return ANYTHING
        if exponent < 0:
            whole = self._power(tree, base, -exponent)
            return _corners(Interval(1.0, 1.0, True), whole, lambda a, b: a / b)
        if exponent % 2 == 0:
            return _even(base, exponent)
        return Interval(_raised(base.low, exponent), _raised(base.high, exponent), base.known)

    def _application(self, tree: Application, limits: Limits) -> Interval:
        name = tree.function
        if name == "lookup":
            for part in tree.arguments[1:] if self.report else ():
                self.of(part, limits)
            first = tree.arguments[0]
            return self.table(first.path) if isinstance(first, Name) else ANYTHING
        if name in ("in", *TIMES):
            return ANYTHING
        parts = [self.of(part, limits) for part in tree.arguments]
        if self.report and name == "sqrt" and parts[0].low < 0.0:
            self.report("root", tree.arguments[0], parts[0])
        return _function(name, parts)

    def _limited(self, condition: Tree, holds: bool, limits: Limits) -> Limits:
        """Return the limits where a condition holds, or does not."""
        match condition:
            case Not(operand, _):
                return self._limited(operand, not holds, limits)
            case Logic(operator, left, right, _) if (operator == "and") == holds:
                return self._limited(right, holds, self._limited(left, holds, limits))
            case Relation(operator, left, right, _) if operator in OPPOSITE:
                operator = operator if holds else OPPOSITE[operator]
                first, second = self.quiet.bound(left, limits), self.quiet.bound(right, limits)
                limits = self._bounded(left, operator, second, limits)
                return self._bounded(right, MIRRORED[operator], first, limits)
        return limits

    def bound(self, side: Tree, limits: Limits) -> Interval:
        """Return the interval of a side of a condition, found once for both its outcomes."""
        key = id(side), id(limits)
        if key not in self.bounds:
            self.bounds[key] = limits, self.of(side, limits)
        return self.bounds[key][1]

    def _bounded(self, side: Tree, operator: str, bound: Interval, limits: Limits) -> Limits:
        number = self.likeness.number(side)
        before = limits.get(number, ANYTHING)
        low, high = -math.inf, math.inf
        if operator == ">":
            low = math.nextafter(bound.low, math.inf)
        elif operator == ">=":
            low = bound.low
        elif operator == "<":
            high = math.nextafter(bound.high, -math.inf)
        else:
            high = bound.high
        made = {**limits, number: before.within(Interval(low, high))}
        if isinstance(side, Application) and side.function == "abs" and low > 0.0:
            made[self._not_zero(side.arguments[0])] = ANYTHING
        return made

    def _not_zero(self, tree: Tree) -> object:
        """The key under which limits say that an expression is not 0: `abs(x) > limit`."""
        return ("not zero", self.likeness.number(tree))

    def _excluded(self, tree: Tree, limits: Limits) -> bool:
        return bool(limits) and self._not_zero(tree) in limits


def _corners(left: Interval, right: Interval, join: Callable[[float, float], float]) -> Interval:
    values = [join(a, b) for a in (left.low, left.high) for b in (right.low, right.high)]
    values = [0.0 if value != value else value for value in values]  # 0 times an infinity
    return Interval(min(values), max(values), left.known and right.known)


def _even(base: Interval, exponent: int) -> Interval:
    ends = [_raised(base.low, exponent), _raised(base.high, exponent)]
    return Interval(0.0 if base.meets_zero else min(ends), max(ends), base.known)


def _raised(value: float, exponent: int) -> float:
    try:
        return float(value**exponent)
    except OverflowError:
        return math.inf if value > 0.0 or exponent % 2 == 0 else -math.inf


def _function(name: str, parts: list[Interval]) -> Interval:
    first, known = parts[0], all(part.known for part in parts)
    match name:
        case "abs":
            sizes = abs(first.low), abs(first.high)
            return Interval(0.0 if first.meets_zero else min(sizes), max(sizes), known)
        case "min" | "max":
            pick = min if name == "min" else max
            return Interval(pick(p.low for p in parts), pick(p.high for p in parts), known)
        case "clip":
            lowest, highest = parts[1].low, parts[2].high
            return Interval(min(max(first.low, lowest), highest), highest, known)
        case "sqrt":
            return Interval(math.sqrt(max(first.low, 0.0)), math.sqrt(max(first.high, 0.0)), known)
        case "exp":
            return Interval(_exponential(first.low), _exponential(first.high), known)
        case "sin" | "cos" | "tanh" | "sign":
            return Interval(-1.0, 1.0, True)
        case "atan2":
            return Interval(-math.pi, math.pi, True)
        case "floor":
            return Interval(first.low - 1.0, first.high, known)
        case "previous" | "delay":
            return first
        case _:
            return ANYTHING


def _exponential(value: float) -> float:
    return math.exp(min(max(value, -708.0), 709.0))
