"""Range analysis: intervals of the values of expressions, from declared ranges and from conditions.

An interval is certain if every name in it has a declared range. An interval that is not certain
never leads to a problem; it still uses the bounds that functions and `if` give. The analysis is
interval arithmetic (Moore 1966), refined by the conditions of enclosing alternatives.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from language.expressions.syntax_tree import (
    FLIPPED_RELATION,
    NEGATED_RELATION,
    TIME_FUNCTIONS,
    Arithmetic,
    Conditional,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    NumberLiteral,
    Power,
    Relation,
    SyntaxTree,
    children,
)
from language.typecheck.interval import (
    UNBOUNDED,
    Interval,
    even_power,
    function_image,
    image_of_corners,
    inverse_power,
    power_or_inf,
    sum_of,
)

Constraints = Mapping[SyntaxTree, Interval]
"""Intervals that enclosing conditions impose on expressions."""
NO_CONSTRAINTS: Constraints = {}
IntervalLookup = Callable[[str], Interval]
DomainReport = Callable[[str, SyntaxTree, Interval], None]


class RangeAnalysis:
    """Interval analysis of expressions.

    `report` gets divisors and arguments outside of their domain. `report` is called with the kind
    ("divisor", "root", "log", "power", "inverse power"), the tree and its interval. While it is
    called, `branch_path` holds the enclosing conditions and whether they are true. Without `report`
    the conditions themselves are not analysed; only the constraints that they impose are.
    """

    def __init__(
        self,
        name_interval: IntervalLookup,
        table_interval: IntervalLookup,
        report: DomainReport | None = None,
    ) -> None:
        """Store the functions that give the intervals of names and of tables by name.

        Without `report` nothing is reported.
        """
        self.name_interval = name_interval
        self.table_interval = table_interval
        self.report = report
        self.without_reports = RangeAnalysis(name_interval, table_interval) if report else self
        self.branch_path: list[tuple[SyntaxTree, bool]] = []

    def analyse(self, tree: SyntaxTree) -> Interval:
        """Return the interval of an expression without constraints; a condition gives UNBOUNDED.

        Calls `report` for each divisor that may be 0 and each argument of `sqrt`, `log` or `pow`
        that may be outside of its domain, certain or not, from the inside out.
        """
        before, self.branch_path = self.branch_path, []
        interval = self.interval_of(tree, NO_CONSTRAINTS)
        self.branch_path = before
        return interval

    def interval_of(self, tree: SyntaxTree, constraints: Constraints) -> Interval:
        """Return the interval of a part of an expression under constraints.

        The interval from its parts is intersected with the constraint on the expression itself.
        Relations, `and`, `or` and `not` give UNBOUNDED; their operands are analysed for reports.
        """
        if isinstance(tree, Relation | Logic | Not):
            if self.report:
                for part in children(tree):
                    self.interval_of(part, constraints)
            return UNBOUNDED
        interval = self._compute_interval(tree, constraints)
        held = constraints.get(tree) if constraints else None
        return interval.intersect(held) if held else interval

    def _compute_interval(self, tree: SyntaxTree, constraints: Constraints) -> Interval:
        """Return the interval of an expression from the intervals of its parts."""
        match tree:
            case NumberLiteral(value, _, _):
                return Interval(float(value), float(value), True)
            case Name(path, _):
                return self.name_interval(path)
            case Negation(operand, _):
                inner = self.interval_of(operand, constraints)
                return Interval(-inner.high, -inner.low, inner.is_certain, inner.excludes_zero)
            case Arithmetic():
                return self._arithmetic(tree, constraints)
            case Power(base, exponent, _):
                return self._power(tree, self.interval_of(base, constraints), exponent)
            case Conditional(condition, then, other, _):
                if self.report:
                    self.interval_of(condition, constraints)
                where_true, where_false = self._constraints_of(condition, constraints)
                held = self._branch_interval(condition, True, then, where_true)
                return held.hull(self._branch_interval(condition, False, other, where_false))
            case FunctionCall():
                return self._call(tree, constraints)
        return UNBOUNDED

    def _branch_interval(
        self, condition: SyntaxTree, holds: bool, tree: SyntaxTree, constraints: Constraints
    ) -> Interval:
        """Return the interval of the alternative `tree` of a choice under its constraints.

        The condition is true there if `holds` is true, else false.
        """
        self.branch_path.append((condition, holds))
        interval = self.interval_of(tree, constraints)
        self.branch_path.pop()
        return interval

    def _arithmetic(self, tree: Arithmetic, constraints: Constraints) -> Interval:
        """Return the interval of an arithmetic operation; report a divisor that may be 0."""
        left, right = (
            self.interval_of(tree.left, constraints),
            self.interval_of(tree.right, constraints),
        )
        match tree.operator:
            case "+":
                return sum_of(left, right)
            case "-":
                return sum_of(left, Interval(-right.high, -right.low, right.is_certain))
            case "*":
                if tree.left == tree.right:
                    return even_power(left, 2)
                return image_of_corners(left, right, lambda a, b: a * b)
        if right.contains_zero and self.report:
            self.report("divisor", tree.right, right)
        if right.low <= 0.0 <= right.high or 0.0 in (right.low, right.high):
            return UNBOUNDED  # an empty interval of an alternative that is never taken may end at 0
        return image_of_corners(left, right, lambda a, b: a / b)

    def _power(self, tree: Power, base: Interval, exponent: int) -> Interval:
        """Return the interval of a power; report a base that may be 0 under a negative exponent."""
        if exponent < 0 and base.contains_zero and self.report:
            self.report("divisor", tree.base, base)
        if exponent < 0 and base.low <= 0.0 <= base.high:
            return UNBOUNDED
        if exponent < 0:
            return inverse_power(base, -exponent)
        if exponent % 2 == 0:
            return even_power(base, exponent)
        return Interval(
            power_or_inf(base.low, exponent), power_or_inf(base.high, exponent), base.is_certain
        )

    def _call(self, tree: FunctionCall, constraints: Constraints) -> Interval:
        """Return the interval of a function call.

        Report arguments of sqrt, log and pow out of domain.
        """
        name = tree.function
        if name == "lookup":
            for part in tree.arguments[1:] if self.report else ():
                self.interval_of(part, constraints)
            first = tree.arguments[0]
            return self.table_interval(first.path) if isinstance(first, Name) else UNBOUNDED
        if name in ("in", *TIME_FUNCTIONS):
            return UNBOUNDED
        parts = [self.interval_of(part, constraints) for part in tree.arguments]
        if self.report and name == "sqrt" and parts[0].low < 0.0:
            self.report("root", tree.arguments[0], parts[0])
        if self.report and name == "log" and parts[0].low <= 0.0:
            self.report("log", tree.arguments[0], parts[0])
        if self.report and name == "pow":
            may_divide = parts[1].low < 0.0
            if parts[0].low < 0.0 or (may_divide and parts[0].low == 0.0):
                kind = "inverse power" if may_divide else "power"
                self.report(kind, tree.arguments[0], parts[0])
        return function_image(name, parts)

    def _constraints_of(
        self, condition: SyntaxTree, constraints: Constraints
    ) -> tuple[Constraints, Constraints]:
        """Return the constraints where a condition is true, and those where it is false.

        Of a disjunction only the constraints that both sides impose are kept, as hulls.
        """
        match condition:
            case Not(operand, _):
                where_true, where_false = self._constraints_of(operand, constraints)
                return where_false, where_true
            case Logic("and", left, right, _):
                where_left, first_false = self._constraints_of(left, constraints)
                where_both, second_false = self._constraints_of(right, where_left)
                return where_both, _either(first_false, second_false)
            case Logic(_, left, right, _):
                first_true, where_not_left = self._constraints_of(left, constraints)
                second_true, where_neither = self._constraints_of(right, where_not_left)
                return _either(first_true, second_true), where_neither
            case Relation(operator, left, right, _):
                first = self.without_reports.interval_of(left, constraints)
                second = self.without_reports.interval_of(right, constraints)

                def where(operator: str) -> Constraints:
                    flipped = FLIPPED_RELATION[operator]
                    inner = self._constrain_by_relation(left, operator, second, constraints)
                    return self._constrain_by_relation(right, flipped, first, inner)

                return where(operator), where(NEGATED_RELATION[operator])
        return constraints, constraints

    def _constrain_by_relation(
        self, side: SyntaxTree, operator: str, bound: Interval, constraints: Constraints
    ) -> Constraints:
        """Return the constraints where `side operator x` is true for some x within `bound`.

        A strict relation excludes the bound itself; `abs(x) > a` with a >= 0 excludes 0 from x.
        Of the relations `!=` only `!= 0` adds a constraint: it excludes 0.
        """
        match operator:
            case ">":
                held = Interval(low=math.nextafter(bound.low, math.inf))
            case ">=":
                held = Interval(low=bound.low)
            case "<":
                held = Interval(high=math.nextafter(bound.high, -math.inf))
            case "<=":
                held = Interval(high=bound.high)
            case "==":
                held = Interval(bound.low, bound.high, excludes_zero=bound.excludes_zero)
            case _ if bound.low == bound.high == 0.0:
                held = Interval(excludes_zero=True)
            case _:
                return constraints
        made = _constrain(side, held, constraints)
        is_above = operator in (">", ">=") and held.low > 0.0
        if is_above and isinstance(side, FunctionCall) and side.function == "abs":
            return _constrain(side.arguments[0], Interval(excludes_zero=True), made)
        return made


def _constrain(side: SyntaxTree, bound: Interval, constraints: Constraints) -> Constraints:
    """Return the constraints with the interval of a side intersected with `bound`."""
    return {**constraints, side: constraints.get(side, UNBOUNDED).intersect(bound)}


def _either(first: Constraints, second: Constraints) -> Constraints:
    """Return the constraints that both of two sets impose, as hulls."""
    return {key: first[key].hull(second[key]) for key in first if key in second}
