"""Bound propagation: disproves conjunctions of linear relations exactly, without a solver.

Each relation between linear expressions bounds the value along a direction: `2 * x - v > 1` and `v
>= 2 * x` bound the same direction from below and from above. An empty interval, or an infeasible
set of inequalities (Fourier-Motzkin), proves that the conditions never hold together. The converse
does not follow.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction

from language.expressions.syntax_tree import FLIPPED_RELATION, NEGATED_RELATION
from language.ir.ops import Binary, Call, Compare, Expr, Ref, Unary, Value
from language.smt.fourier_motzkin import Inequality, is_infeasible
from language.smt.query import SolverQuery, VariableDomain

Direction = tuple[tuple[str, Fraction], ...]
"""Coefficients by variable, sorted by name, scaled so that the first coefficient is 1."""
LinearForm = tuple[dict[str, Fraction], Fraction]
"""Coefficients by variable, and the constant term."""


def is_disproved_by_bounds(query: SolverQuery) -> bool:
    """Return whether linear bounds prove that the conditions never hold together.

    False means that nothing is known. No solver is called (see `narrow_domains`).
    """
    return narrow_domains(query) is None


def narrow_domains(query: SolverQuery) -> dict[str, VariableDomain] | None:
    """Return narrower domains of variables that the conditions imply; None if they never hold.

    Only variables that a relation bounds alone, without their default, or that stand alone as a
    Boolean, with the required value as default, are in the result. Bounds are closed even for
    strict relations. Conditions that are not linear, `!=` and alternatives (`or`) are ignored.
    """
    forms = _LinearForms(query)
    bounds: dict[Direction, _DirectionBounds] = {}
    truths: dict[str, bool] = {}
    inequalities: list[Inequality] = []
    for condition in query.conditions:
        for part, is_true in _split_conjunction(condition, True, forms):
            match part:
                case Value(value) if isinstance(value, bool) and value != is_true:
                    return None
                case Ref(name) if truths.setdefault(name, is_true) != is_true:
                    return None
                case Compare(operator, left, right):
                    form = forms.difference(left, right)
                    relation = str(operator) if is_true else NEGATED_RELATION[operator]
                    if form is not None and _apply_relation(form, relation, bounds, query):
                        return None
                    inequalities += _inequalities(form, relation)
    if is_infeasible(inequalities):
        return None
    return {**_domains_from_bounds(bounds, query), **_domains_from_truths(truths, query)}


def _inequalities(form: LinearForm | None, operator: str) -> Iterator[Inequality]:
    """Yield `form operator 0` as inequalities `form > 0` or `form >= 0`.

    There are none if the form is None or the operator is `!=`.
    """
    if form is not None and operator in (">", ">=", "=="):
        yield form[0], form[1], operator == ">"
    if form is not None and operator in ("<", "<=", "=="):
        factors = {name: -value for name, value in form[0].items()}
        yield factors, -form[1], operator == "<"


def _domains_from_bounds(
    bounds: Mapping[Direction, _DirectionBounds], query: SolverQuery
) -> dict[str, VariableDomain]:
    """Return the domains of the variables that are bounded alone, without their defaults."""
    result: dict[str, VariableDomain] = {}
    for direction, interval in bounds.items():
        if len(direction) == 1:
            name = direction[0][0]
            domain = query.domains[name]
            result[name] = replace(domain, low=interval.low, high=interval.high, default=None)
    return result


def _domains_from_truths(
    truths: Mapping[str, bool], query: SolverQuery
) -> dict[str, VariableDomain]:
    """Return the domains of the Boolean variables with their required values as defaults."""
    domains = query.domains
    return {
        name: replace(domains[name], default=value)
        for name, value in truths.items()
        if name in domains
    }


class _DirectionBounds:
    """Interval of the value along a direction; each end is open, closed or absent (None)."""

    def __init__(self) -> None:
        self.low: Fraction | None = None
        self.high: Fraction | None = None
        self.is_low_open = self.is_high_open = False

    def tighten_low(self, limit: Fraction, is_open: bool) -> None:
        """Raise the lower bound to a limit if the limit is stricter."""
        if self.low is None or limit > self.low:
            self.low, self.is_low_open = limit, is_open
        elif limit == self.low:
            self.is_low_open |= is_open

    def tighten_high(self, limit: Fraction, is_open: bool) -> None:
        """Lower the upper bound to a limit if the limit is stricter."""
        if self.high is None or limit < self.high:
            self.high, self.is_high_open = limit, is_open
        elif limit == self.high:
            self.is_high_open |= is_open

    @property
    def is_empty(self) -> bool:
        """Whether no value lies between the bounds."""
        if self.low is None or self.high is None:
            return False
        touching = self.low == self.high and (self.is_low_open or self.is_high_open)
        return self.low > self.high or touching


def _apply_relation(
    form: LinearForm, operator: str, bounds: dict[Direction, _DirectionBounds], query: SolverQuery
) -> bool:
    """Intersect the bounds of a direction with `form operator 0`; return whether nothing remains.

    A form without variables is compared with 0. The operator `!=` changes nothing.
    """
    factors, constant = form
    if operator == "!=":
        return False
    names = sorted(name for name, factor in factors.items() if factor)
    if not names:
        return not _relation_holds(constant, operator)
    scale = factors[names[0]]
    operator = operator if scale > 0 else FLIPPED_RELATION[operator]
    direction = tuple((name, factors[name] / scale) for name in names)
    if direction not in bounds:
        bounds[direction] = _declared_bounds(direction, query)
    interval, limit = bounds[direction], -constant / scale
    if operator in (">", ">=", "=="):
        interval.tighten_low(limit, operator == ">")
    if operator in ("<", "<=", "=="):
        interval.tighten_high(limit, operator == "<")
    return interval.is_empty


def _declared_bounds(direction: Direction, query: SolverQuery) -> _DirectionBounds:
    """Return the bounds of a direction that follow from the domains of its variables."""
    bounds = _DirectionBounds()
    low, high = Fraction(0), Fraction(0)
    has_low = has_high = True
    for name, factor in direction:
        domain = query.domains[name]
        first, last = (domain.low, domain.high) if factor > 0 else (domain.high, domain.low)
        has_low, has_high = has_low and first is not None, has_high and last is not None
        low += factor * (first or 0)
        high += factor * (last or 0)
    if has_low:
        bounds.tighten_low(low, False)
    if has_high:
        bounds.tighten_high(high, False)
    return bounds


def _relation_holds(value: Fraction, operator: str) -> bool:
    """Return whether `value operator 0` holds."""
    match operator:
        case "<":
            return value < 0
        case "<=":
            return value <= 0
        case ">":
            return value > 0
        case ">=":
            return value >= 0
    return value == 0


def _split_conjunction(
    condition: Expr, is_true: bool, forms: _LinearForms
) -> Iterator[tuple[Expr, bool]]:
    """Yield the parts of a condition, each with its required truth, that imply the condition.

    `and` (or a negated `or`) is split, `not` inverts the truth, and a name with an assignment is
    expanded.
    """
    match condition:
        case Unary("not", operand):
            yield from _split_conjunction(operand, not is_true, forms)
        case Binary("and", left, right) if is_true:
            yield from _split_conjunction(left, True, forms)
            yield from _split_conjunction(right, True, forms)
        case Binary("or", left, right) if not is_true:
            yield from _split_conjunction(left, False, forms)
            yield from _split_conjunction(right, False, forms)
        case Ref(name) if name in forms.assignments:
            yield from _split_conjunction(forms.assignments[name], is_true, forms)
        case _:
            yield condition, is_true


class _LinearForms:
    """Linear forms of expressions over the variables of a query.

    Assigned names are expanded, and the form of each name is cached.
    """

    def __init__(self, query: SolverQuery) -> None:
        self.query = query
        self.assignments = dict(query.assignments)
        self.forms_by_name: dict[str, LinearForm | None] = {}

    def difference(self, left: Expr, right: Expr) -> LinearForm | None:
        """Return `left - right` as a linear form, or None if it is not linear."""
        return self._add_scaled(self._form_of(left), self._form_of(right), Fraction(-1))

    def _form_of(self, expr: Expr) -> LinearForm | None:
        """Return an expression as a linear form, or None if it is not linear."""
        match expr:
            case Value(value):
                return _constant_form(value)
            case Ref(name):
                return self._form_of_name(name)
            case Unary("-", operand):
                return self._add_scaled(({}, Fraction(0)), self._form_of(operand), Fraction(-1))
            case Binary("+", left, right):
                return self._add_scaled(self._form_of(left), self._form_of(right), Fraction(1))
            case Binary("-", left, right):
                return self._add_scaled(self._form_of(left), self._form_of(right), Fraction(-1))
            case Binary("*", left, right):
                first, second = self._form_of(left), self._form_of(right)
                if first is not None and not first[0]:
                    return self._add_scaled(({}, Fraction(0)), second, first[1])
                if second is not None and not second[0]:
                    return self._add_scaled(({}, Fraction(0)), first, second[1])
                return None
            case Binary("/", left, right):
                second = self._form_of(right)
                if second is None or second[0] or not second[1]:
                    return None
                return self._add_scaled(({}, Fraction(0)), self._form_of(left), 1 / second[1])
            case Call("real", (operand,)):
                return self._form_of(operand)
        return None

    def _form_of_name(self, name: str) -> LinearForm | None:
        """Return the form of an assigned name, a variable or a constant; None for anything else."""
        if name not in self.forms_by_name:
            if name in self.assignments:
                self.forms_by_name[name] = self._form_of(self.assignments[name])
            elif name in self.query.domains:
                self.forms_by_name[name] = {name: Fraction(1)}, Fraction(0)
            else:
                value = self.query.parameter_values.get(name)
                self.forms_by_name[name] = _constant_form(value)
        return self.forms_by_name[name]

    @staticmethod
    def _add_scaled(
        left: LinearForm | None, right: LinearForm | None, factor: Fraction
    ) -> LinearForm | None:
        """Return `left + factor * right` without zero coefficients; None if an operand is None."""
        if left is None or right is None:
            return None
        coefficients = dict(left[0])
        for name, value in right[0].items():
            coefficients[name] = coefficients.get(name, Fraction(0)) + factor * value
        nonzero = {name: value for name, value in coefficients.items() if value}
        return nonzero, left[1] + factor * right[1]


def _constant_form(value: object) -> LinearForm | None:
    """Return a finite number as a form without variables; None for any other value."""
    if isinstance(value, bool) or not isinstance(value, float | int) or not math.isfinite(value):
        return None
    return {}, Fraction(value)
