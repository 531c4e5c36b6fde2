"""Halfspaces: linear conditions that exclude each other, found exactly without a solver.

Each relation of linear sides bounds a direction: `2 * x - v > 1` and `v >= 2 * x` bound the same
one from below and from above. Bounds that leave nothing prove that conditions never hold together;
that they leave something proves nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction

from language.ir.ops import Binary, Call, Compare, Expr, Ref, Unary, Value
from language.smt.fourier_motzkin import Inequality, is_infeasible
from language.smt.query import SolverQuery, VariableDomain

Direction = tuple[tuple[str, Fraction], ...]
LinearForm = tuple[dict[str, Fraction], Fraction]
"""Coefficients by variable, and the constant."""
NEGATED_RELATION = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
FLIPPED_RELATION = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


def is_disproved_by_bounds(query: SolverQuery) -> bool:
    """Tell whether bounds of linear forms prove that the conditions never hold together."""
    return narrow_domains(query) is None


def narrow_domains(query: SolverQuery) -> dict[str, VariableDomain] | None:
    """Return what single variables can be where the conditions hold; None if they never do."""
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
                    found = forms.difference(left, right)
                    relation = str(operator) if is_true else NEGATED_RELATION[operator]
                    if found is not None and _apply_relation(found, relation, bounds, query):
                        return None
                    inequalities += _inequalities(found, relation)
    if is_infeasible(inequalities):
        return None
    return {**_domains_from_bounds(bounds, query), **_domains_from_truths(truths, query)}


def _inequalities(form: LinearForm | None, operator: str) -> Iterator[Inequality]:
    """Yield what `form operator 0` says, as what is above 0."""
    if form is not None and operator in (">", ">=", "=="):
        yield form[0], form[1], operator == ">"
    if form is not None and operator in ("<", "<=", "=="):
        factors = {name: -value for name, value in form[0].items()}
        yield factors, -form[1], operator == "<"


def _domains_from_bounds(
    bounds: Mapping[Direction, _DirectionBounds], query: SolverQuery
) -> dict[str, VariableDomain]:
    found: dict[str, VariableDomain] = {}
    for direction, held in bounds.items():
        if len(direction) == 1:
            name = direction[0][0]
            extent = query.domains[name]
            found[name] = replace(extent, low=held.low, high=held.high, default=None)
    return found


def _domains_from_truths(
    truths: Mapping[str, bool], query: SolverQuery
) -> dict[str, VariableDomain]:
    extents = query.domains
    return {
        name: replace(extents[name], default=value)
        for name, value in truths.items()
        if name in extents
    }


class _DirectionBounds:
    """From where to where the value of a direction goes, and which ends are left out."""

    def __init__(self) -> None:
        self.low: Fraction | None = None
        self.high: Fraction | None = None
        self.is_low_open = self.is_high_open = False

    def tighten_low(self, limit: Fraction, is_open: bool) -> None:
        if self.low is None or limit > self.low:
            self.low, self.is_low_open = limit, is_open
        elif limit == self.low:
            self.is_low_open |= is_open

    def tighten_high(self, limit: Fraction, is_open: bool) -> None:
        if self.high is None or limit < self.high:
            self.high, self.is_high_open = limit, is_open
        elif limit == self.high:
            self.is_high_open |= is_open

    @property
    def is_empty(self) -> bool:
        if self.low is None or self.high is None:
            return False
        touching = self.low == self.high and (self.is_low_open or self.is_high_open)
        return self.low > self.high or touching


def _apply_relation(
    form: LinearForm, operator: str, bounds: dict[Direction, _DirectionBounds], query: SolverQuery
) -> bool:
    """Take in `form operator 0`; tell whether nothing is left."""
    factors, constant = form
    if operator not in FLIPPED_RELATION:
        return False
    names = sorted(name for name, factor in factors.items() if factor)
    if not names:
        return not _relation_holds(constant, operator)
    scale = factors[names[0]]
    operator = operator if scale > 0 else FLIPPED_RELATION[operator]
    direction = tuple((name, factors[name] / scale) for name in names)
    if direction not in bounds:
        bounds[direction] = _declared_bounds(direction, query)
    held, limit = bounds[direction], -constant / scale
    if operator in (">", ">=", "=="):
        held.tighten_low(limit, operator == ">")
    if operator in ("<", "<=", "=="):
        held.tighten_high(limit, operator == "<")
    return held.is_empty


def _declared_bounds(direction: Direction, query: SolverQuery) -> _DirectionBounds:
    """Return the bounds of a direction that follow from those of its variables."""
    found = _DirectionBounds()
    low, high = Fraction(0), Fraction(0)
    has_low = has_high = True
    for name, factor in direction:
        extent = query.domains[name]
        first, last = (extent.low, extent.high) if factor > 0 else (extent.high, extent.low)
        has_low, has_high = has_low and first is not None, has_high and last is not None
        low += factor * (first or 0)
        high += factor * (last or 0)
    if has_low:
        found.tighten_low(low, False)
    if has_high:
        found.tighten_high(high, False)
    return found


def _relation_holds(value: Fraction, operator: str) -> bool:
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
    """Yield the parts that all have to be true, or false, for a condition to be as it is said."""
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
    """Linear forms of expressions over the variables of a question; each step's found once."""

    def __init__(self, query: SolverQuery) -> None:
        self.question = query
        self.assignments = dict(query.assignments)
        self.forms_by_name: dict[str, LinearForm | None] = {}

    def difference(self, left: Expr, right: Expr) -> LinearForm | None:
        """Return left - right as a form, None if it is not linear."""
        return self._add_scaled(self._form_of(left), self._form_of(right), Fraction(-1))

    def _form_of(self, expr: Expr) -> LinearForm | None:
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
        if name not in self.forms_by_name:
            if name in self.assignments:
                self.forms_by_name[name] = self._form_of(self.assignments[name])
            elif name in self.question.domains:
                self.forms_by_name[name] = {name: Fraction(1)}, Fraction(0)
            else:
                value = self.question.parameter_values.get(name)
                self.forms_by_name[name] = _constant_form(value)
        return self.forms_by_name[name]

    @staticmethod
    def _add_scaled(
        left: LinearForm | None, right: LinearForm | None, factor: Fraction
    ) -> LinearForm | None:
        """Return left + factor * right."""
        if left is None or right is None:
            return None
        found = dict(left[0])
        for name, value in right[0].items():
            found[name] = found.get(name, Fraction(0)) + factor * value
        kept = {name: value for name, value in found.items() if value}
        return kept, left[1] + factor * right[1]


def _constant_form(value: object) -> LinearForm | None:
    if isinstance(value, bool) or not isinstance(value, float | int) or not math.isfinite(value):
        return None
    return {}, Fraction(value)
