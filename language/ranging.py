"""Ranging: what values an expression can have, from the ranges that are declared.

An interval is known where every name in it has a declared range. What is not known never gives a
problem: bounds are then only used where a function or an `if` gives them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from language.interval import ANYTHING, Interval, corners, even, image, raised
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
Limits = Mapping[int, Interval]
"""What enclosing conditions say of expressions, by the number of what is written alike."""
NO_LIMITS: Limits = {}
Look = Callable[[str], Interval]
Report = Callable[[str, Tree, Interval], None]


class Ranging:
    """Finds intervals; `look` gives those of names, `report` takes divisors and roots.

    A quiet one has no `report`: what conditions say is not looked into, only what they exclude.
    While it reports, `path` holds the conditions around a place and whether they hold there.
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
        self.path: list[tuple[Tree, bool]] = []

    def expression(self, tree: Tree) -> Interval:
        """Return the interval of an expression, reporting what is outside a domain inside it."""
        self.quiet.bounds.clear()
        before, self.path = self.path, []
        found = self.of(tree, NO_LIMITS)
        self.path = before
        return found

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
                return Interval(-inner.high, -inner.low, inner.known, inner.broken)
            case Arithmetic():
                return self._arithmetic(tree, limits)
            case Power(base, exponent, _):
                return self._power(tree, self.of(base, limits), exponent)
            case Choice(condition, then, other, _):
                if self.report:
                    self.of(condition, limits)
                held = self._where(condition, True, then, limits)
                return held.joined(self._where(condition, False, other, limits))
            case Application():
                return self._application(tree, limits)
        return ANYTHING

    def _where(self, condition: Tree, holds: bool, tree: Tree, limits: Limits) -> Interval:
        """Return the interval of an alternative of a choice."""
        self.path.append((condition, holds))
        found = self.of(tree, self._limited(condition, holds, limits))
        self.path.pop()
        return found

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
                    return even(left, 2)
                return corners(left, right, lambda a, b: a * b)
        if right.meets_zero and self.report:
            self.report("divisor", tree.right, right)
        if right.low <= 0.0 <= right.high:
            return ANYTHING
        return corners(left, right, lambda a, b: a / b)

    def _power(self, tree: Power, base: Interval, exponent: int) -> Interval:
        if exponent < 0 and base.meets_zero and self.report:
            self.report("divisor", tree.base, base)
        if exponent < 0 and base.low <= 0.0 <= base.high:
            return ANYTHING
        if exponent < 0:
            whole = self._power(tree, base, -exponent)
            return corners(Interval(1.0, 1.0, True), whole, lambda a, b: a / b)
        if exponent % 2 == 0:
            return even(base, exponent)
        return Interval(raised(base.low, exponent), raised(base.high, exponent), base.known)

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
        if self.report and name == "log" and parts[0].low <= 0.0:
            self.report("log", tree.arguments[0], parts[0])
        if self.report and name == "pow":
            may_divide = parts[1].low < 0.0
            if parts[0].low < 0.0 or (may_divide and parts[0].low == 0.0):
                kind = "inverse power" if may_divide else "power"
                self.report(kind, tree.arguments[0], parts[0])
        return image(name, parts)

    def _limited(self, condition: Tree, holds: bool, limits: Limits) -> Limits:
        """Return the limits where a condition holds, or does not."""
        match condition:
            case Not(operand, _):
                return self._limited(operand, not holds, limits)
            case Logic(operator, left, right, _) if (operator == "and") == holds:
                return self._limited(right, holds, self._limited(left, holds, limits))
            case Logic(_, left, right, _):
                either = self._limited(left, holds, limits)
                other = self._limited(right, holds, self._limited(left, not holds, limits))
                return {key: either[key].joined(other[key]) for key in either if key in other}
            case Relation(operator, left, right, _) if operator in OPPOSITE:
                operator = operator if holds else OPPOSITE[operator]
                first, second = self.quiet.bound(left, limits), self.quiet.bound(right, limits)
                limits = self._bounded(left, operator, second, limits)
                return self._bounded(right, MIRRORED[operator], first, limits)
            case Relation(operator, left, right, _) if operator in ("==", "!="):
                sides = self.quiet.bound(left, limits), self.quiet.bound(right, limits)
                bounded = self._same if (operator == "==") == holds else self._other
                return bounded(right, sides[0], bounded(left, sides[1], limits))
        return limits

    def bound(self, side: Tree, limits: Limits) -> Interval:
        """Return the interval of a side of a condition, found once for both its outcomes."""
        key = id(side), id(limits)
        if key not in self.bounds:
            self.bounds[key] = limits, self.of(side, limits)
        return self.bounds[key][1]

    def _bounded(self, side: Tree, operator: str, bound: Interval, limits: Limits) -> Limits:
        low, high = -math.inf, math.inf
        if operator == ">":
            low = math.nextafter(bound.low, math.inf)
        elif operator == ">=":
            low = bound.low
        elif operator == "<":
            high = math.nextafter(bound.high, -math.inf)
        else:
            high = bound.high
        made = self._within(side, Interval(low, high), limits)
        if isinstance(side, Application) and side.function == "abs" and low > 0.0:
            return self._within(side.arguments[0], Interval(broken=True), made)
        return made

    def _same(self, side: Tree, bound: Interval, limits: Limits) -> Limits:
        """Return the limits where a side is equal to what has a bound."""
        return self._within(side, Interval(bound.low, bound.high, broken=bound.broken), limits)

    def _other(self, side: Tree, bound: Interval, limits: Limits) -> Limits:
        """Return the limits where a side is not equal to what has a bound: here only 0 counts."""
        is_zero = bound.low == bound.high == 0.0
        return self._within(side, Interval(broken=True), limits) if is_zero else limits

    def _within(self, side: Tree, bound: Interval, limits: Limits) -> Limits:
        number = self.likeness.number(side)
        return {**limits, number: limits.get(number, ANYTHING).within(bound)}
