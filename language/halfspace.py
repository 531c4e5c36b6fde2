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

from language.elimination import Inequality, is_infeasible
from language.operation import Binary, Call, Compare, Expr, Ref, Unary, Value
from language.question import Extent, Question

Direction = tuple[tuple[str, Fraction], ...]
Form = tuple[dict[str, Fraction], Fraction]
"""Coefficients by variable, and the constant."""
OPPOSITE = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


def disproved(question: Question) -> bool:
    """Tell whether bounds of linear forms prove that the conditions never hold together."""
    return narrowed(question) is None


def narrowed(question: Question) -> dict[str, Extent] | None:
    """Return what single variables can be where the conditions hold; None if they never do."""
    forms = _Forms(question)
    bounds: dict[Direction, _Bounds] = {}
    truths: dict[str, bool] = {}
    inequalities: list[Inequality] = []
    for condition in question.conditions:
        for part, is_true in _together(condition, True, forms):
            match part:
                case Value(value) if isinstance(value, bool) and value != is_true:
                    return None
                case Ref(name) if truths.setdefault(name, is_true) != is_true:
                    return None
                case Compare(operator, left, right):
                    found = forms.difference(left, right)
                    relation = str(operator) if is_true else OPPOSITE[operator]
                    if found is not None and _contradicts(found, relation, bounds, question):
                        return None
                    inequalities += _inequalities(found, relation)
    if is_infeasible(inequalities):
        return None
    return {**_narrower(bounds, question), **_certain(truths, question)}


def _inequalities(form: Form | None, operator: str) -> Iterator[Inequality]:
    """Yield what `form operator 0` says, as what is above 0."""
    if form is not None and operator in (">", ">=", "=="):
        yield form[0], form[1], operator == ">"
    if form is not None and operator in ("<", "<=", "=="):
        factors = {name: -value for name, value in form[0].items()}
        yield factors, -form[1], operator == "<"


def _narrower(bounds: Mapping[Direction, _Bounds], question: Question) -> dict[str, Extent]:
    found: dict[str, Extent] = {}
    for direction, held in bounds.items():
        if len(direction) == 1:
            name = direction[0][0]
            extent = question.extents[name]
            found[name] = replace(extent, low=held.low, high=held.high, default=None)
    return found


def _certain(truths: Mapping[str, bool], question: Question) -> dict[str, Extent]:
    extents = question.extents
    return {
        name: replace(extents[name], default=value)
        for name, value in truths.items()
        if name in extents
    }


class _Bounds:
    """From where to where the value of a direction goes, and which ends are left out."""

    def __init__(self) -> None:
        self.low: Fraction | None = None
        self.high: Fraction | None = None
        self.is_low_open = self.is_high_open = False

    def above(self, limit: Fraction, is_open: bool) -> None:
        if self.low is None or limit > self.low:
            self.low, self.is_low_open = limit, is_open
        elif limit == self.low:
            self.is_low_open |= is_open

    def below(self, limit: Fraction, is_open: bool) -> None:
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


def _contradicts(
    form: Form, operator: str, bounds: dict[Direction, _Bounds], question: Question
) -> bool:
    """Take in `form operator 0`; tell whether nothing is left."""
    factors, constant = form
    if operator not in MIRRORED:
        return False
    names = sorted(name for name, factor in factors.items() if factor)
    if not names:
        return not _is_so(constant, operator)
    scale = factors[names[0]]
    operator = operator if scale > 0 else MIRRORED[operator]
    direction = tuple((name, factors[name] / scale) for name in names)
    if direction not in bounds:
        bounds[direction] = _declared(direction, question)
    held, limit = bounds[direction], -constant / scale
    if operator in (">", ">=", "=="):
        held.above(limit, operator == ">")
    if operator in ("<", "<=", "=="):
        held.below(limit, operator == "<")
    return held.is_empty


def _declared(direction: Direction, question: Question) -> _Bounds:
    """Return the bounds of a direction that follow from those of its variables."""
    found = _Bounds()
    low, high = Fraction(0), Fraction(0)
    has_low = has_high = True
    for name, factor in direction:
        extent = question.extents[name]
        first, last = (extent.low, extent.high) if factor > 0 else (extent.high, extent.low)
        has_low, has_high = has_low and first is not None, has_high and last is not None
        low += factor * (first or 0)
        high += factor * (last or 0)
    if has_low:
        found.above(low, False)
    if has_high:
        found.below(high, False)
    return found


def _is_so(value: Fraction, operator: str) -> bool:
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


def _together(condition: Expr, is_true: bool, forms: _Forms) -> Iterator[tuple[Expr, bool]]:
    """Yield the parts that all have to be true, or false, for a condition to be as it is said."""
    match condition:
        case Unary("not", operand):
            yield from _together(operand, not is_true, forms)
        case Binary("and", left, right) if is_true:
            yield from _together(left, True, forms)
            yield from _together(right, True, forms)
        case Binary("or", left, right) if not is_true:
            yield from _together(left, False, forms)
            yield from _together(right, False, forms)
        case Ref(name) if name in forms.steps:
            yield from _together(forms.steps[name], is_true, forms)
        case _:
            yield condition, is_true


class _Forms:
    """Linear forms of expressions over the variables of a question; each step's found once."""

    def __init__(self, question: Question) -> None:
        self.question = question
        self.steps = dict(question.steps)
        self.known: dict[str, Form | None] = {}

    def difference(self, left: Expr, right: Expr) -> Form | None:
        """Return left - right as a form, None if it is not linear."""
        return self._sum(self._of(left), self._of(right), Fraction(-1))

    def _of(self, expr: Expr) -> Form | None:
        match expr:
            case Value(value):
                return _constant(value)
            case Ref(name):
                return self._named(name)
            case Unary("-", operand):
                return self._sum(({}, Fraction(0)), self._of(operand), Fraction(-1))
            case Binary("+", left, right):
                return self._sum(self._of(left), self._of(right), Fraction(1))
            case Binary("-", left, right):
                return self._sum(self._of(left), self._of(right), Fraction(-1))
            case Binary("*", left, right):
                first, second = self._of(left), self._of(right)
                if first is not None and not first[0]:
                    return self._sum(({}, Fraction(0)), second, first[1])
                if second is not None and not second[0]:
                    return self._sum(({}, Fraction(0)), first, second[1])
                return None
            case Binary("/", left, right):
                second = self._of(right)
                if second is None or second[0] or not second[1]:
                    return None
                return self._sum(({}, Fraction(0)), self._of(left), 1 / second[1])
            case Call("real", (operand,)):
                return self._of(operand)
        return None

    def _named(self, name: str) -> Form | None:
        if name not in self.known:
            if name in self.steps:
                self.known[name] = self._of(self.steps[name])
            elif name in self.question.extents:
                self.known[name] = {name: Fraction(1)}, Fraction(0)
            else:
                value = self.question.values.get(name)
                self.known[name] = _constant(value)
        return self.known[name]

    @staticmethod
    def _sum(left: Form | None, right: Form | None, factor: Fraction) -> Form | None:
        """Return left + factor * right."""
        if left is None or right is None:
            return None
        found = dict(left[0])
        for name, value in right[0].items():
            found[name] = found.get(name, Fraction(0)) + factor * value
        kept = {name: value for name, value in found.items() if value}
        return kept, left[1] + factor * right[1]


def _constant(value: object) -> Form | None:
    if isinstance(value, bool) or not isinstance(value, float | int) or not math.isfinite(value):
        return None
    return {}, Fraction(value)
