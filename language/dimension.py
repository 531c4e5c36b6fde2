"""Dimension check: the dimension of every expression, and what does not fit (rule 20)."""

from __future__ import annotations

import dataclasses

from language.function import function_kind
from language.kind import (
    LARGEST_WHOLE,
    Enumeration,
    Kind,
    Truthful,
    Whole,
    as_real,
    combined,
    compared_hint,
    said,
    truth_hint,
    wholes_of,
)
from language.problem import Problems, Span, nearest
from language.scope import Scope
from language.syntax import (
    Application,
    Arithmetic,
    Broken,
    Choice,
    Logic,
    Name,
    Negative,
    Not,
    Number,
    Power,
    Relation,
    Tree,
    Truth,
    is_zero,
    whole_literal,
)
from language.units import (
    NO_UNIT,
    Dimension,
    angle_hint,
    common,
    fits,
    power,
    product,
    units_hint,
)

MOST_HINTS = 200
"""Problems after which no nearest name is looked for: all names are compared with it."""


class DimensionCheck:
    """Infers dimensions bottom up; reports each mistake once and goes on."""

    def __init__(self, scope: Scope, problems: Problems) -> None:
        """Check against `scope`, report into `problems`."""
        self.scope = scope
        self.problems = problems

    def remembering(self, *functions: str) -> DimensionCheck:
        """Return the check of what stands inside a function with memory."""
        memory = self.scope.memory & {*functions}
        return DimensionCheck(dataclasses.replace(self.scope, memory=memory), self.problems)

    def quantity(self, tree: Tree, want: Dimension, what: str) -> None:
        """Check that an expression is a quantity that fits `want`."""
        kind = as_real(self.kind(tree))
        if isinstance(kind, str | Enumeration):
            label = f"`{what}` is a quantity, this is {said(kind)}"
            self.report("type", tree.span, label)
        elif isinstance(kind, Dimension) and not is_zero(tree) and not fits(kind, want):
            label = f"this is in `{kind.shown}`, `{what}` is in `{want.shown}`"
            hint = angle_hint(kind, want)
            if isinstance(tree, Number | Negative):
                hint = hint or units_hint(want)
            self.report("dimension", tree.span, label, hint)

    def assigned(self, tree: Tree, want: Kind, what: str) -> None:
        """Check that an expression may be assigned to something of a kind."""
        if isinstance(want, Dimension):
            self.quantity(tree, want, what)
        elif want == "truth":
            self._same(tree, "truth", what)
        elif isinstance(want, Enumeration):
            self._same(tree, want, what)
        elif whole_literal(tree) is None:
            kind = self.kind(tree)
            is_floor = isinstance(tree, Application) and tree.function == "floor"
            if kind is not None and not isinstance(kind, Whole) and not is_floor:
                hint = "`floor(...)` makes a whole number of a real"
                label = f"`{what}` is a whole number, this is {said(kind)}"
                self.report("type", tree.span, label, hint if isinstance(kind, Dimension) else "")

    def _same(self, tree: Tree, want: Kind, what: str) -> None:
        kind = self.kind(tree)
        if kind is not None and kind != want:
            label = f"`{what}` is {said(want)}, this is {said(kind)}"
            hint = truth_hint(tree) if want == "truth" else ""
            self.report("type", tree.span, label, hint)

    def truth(self, tree: Tree, what: str) -> None:
        """Check that an expression is true or false."""
        kind = self.kind(tree)
        if kind is not None and kind != "truth":
            hint = truth_hint(tree)
            label = f"`{what}` is a condition, this is {said(kind)}"
            self.report("type", tree.span, label, hint)

    def kind(self, tree: Tree) -> Kind | None:
        """Return what the expression is, None where a problem was reported inside it."""
        match tree:
            case Name():
                return self._name(tree)
            case Number(_, unit, _):
                return unit.dimension
            case Arithmetic():
                return self._arithmetic(tree)
            case Application():
                return function_kind(self, tree)
            case Truth():
                return "truth"
            case Negative(operand, _):
                kind = self.kind(operand)
                if isinstance(kind, Whole):
                    return Whole(-kind.high, -kind.low)
                return self.number(kind, operand)
            case Not(operand, _):
                self.truth(operand, "not")
                return "truth"
            case Logic(operator, left, right, _):
                self.truth(left, operator)
                self.truth(right, operator)
                return "truth"
            case Relation():
                return self._relation(tree)
            case Power(base, exponent, _):
                kind = self.real(base)
                return None if kind is None else power(kind, exponent)
            case Choice():
                return self._choice(tree)
            case Broken():
                return None

    def report(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Report a problem."""
        self.problems.error(kind, span, label, help)

    def real(self, tree: Tree) -> Dimension | None:
        """Return the dimension of a quantity; reports what is none."""
        return self.number(self.kind(tree), tree)

    def number(self, kind: Kind | None, tree: Tree) -> Dimension | None:
        """What a whole number is in arithmetic of reals: a number without a unit."""
        kind = as_real(kind)
        if isinstance(kind, Dimension):
            return kind
        if kind is not None:
            self.report("type", tree.span, f"this is {said(kind)}, a quantity is needed")
        return None

    def _name(self, tree: Name) -> Kind | None:
        if tree.path in self.scope.tables:
            hint = f"read it with `lookup({tree.path}, ...)`"
            self.report("table", tree.span, f"`{tree.path}` is a table, not a value", hint)
            return None
        if tree.path in self.scope.names:
            return self.scope.names[tree.path]
        few = len(self.problems.found) < MOST_HINTS
        hint = nearest(tree.path, self.scope.names) if few else ""
        owner = self.scope.owners.get(tree.path, self.scope.mode)
        if owner != self.scope.mode:
            hint = f"mode `{owner}` has an equation of it, mode `{self.scope.mode}` has none"
        if tree.path in self.scope.events:
            hint = f"it is an event: write `event: {tree.path}` on a transition"
        self.report("name", tree.span, f"`{tree.path}` is not known {self.scope.place}", hint)
        return None

    def _arithmetic(self, tree: Arithmetic) -> Dimension | Whole | None:
        first, second = self.kind(tree.left), self.kind(tree.right)
        wholes = wholes_of(tree.left, first, tree.right, second)
        if wholes and tree.operator != "/":
            return self._safe(combined(tree.operator, *wholes), tree)
        left, right = self.number(first, tree.left), self.number(second, tree.right)
        if left is None or right is None:
            return None
        if tree.operator in "*/":
            return product(left, right, 1 if tree.operator == "*" else -1)
        for part in (tree.left, tree.right):
            if isinstance(part, Number) and part.unit.offset:
                label = "a temperature in degC is not added or subtracted"
                self.report("dimension", part.span, label, "write a difference in K")
        self._one_unit_of_angle(tree)
        return self.together(tree.left, left, tree.right, right, tree.span, tree.operator)

    def _one_unit_of_angle(self, tree: Arithmetic) -> None:
        """Two declared numbers in `deg` and `rad` are not added: rule 20, nothing is converted."""
        known = self.scope.angles
        first, second = (
            known.get(part.path) if isinstance(part, Name) else None
            for part in (tree.left, tree.right)
        )
        if first and second and first.factor != second.factor:
            label = f"`{tree.operator}` joins `{first.text}` and `{second.text}`"
            self.report("dimension", tree.span, label, "declare both in one unit of angle")

    def _safe(self, kind: Whole, tree: Arithmetic) -> Whole:
        """Whole numbers are held in 32 bits: what may not fit is a problem."""
        if kind.is_safe:
            return kind
        label = f"this may lie from {kind.low} to {kind.high}: past {LARGEST_WHOLE}"
        hint = "give the whole numbers in it a narrower `range`"
        self.report("overflow", tree.span, label, hint)
        return Whole()

    def together(
        self, a: Tree, left: Dimension, b: Tree, right: Dimension, span: Span, operator: str
    ) -> Dimension | None:
        """Return the dimension of what joins `a` and `b`; reports where they do not fit."""
        if is_zero(a):
            return right
        if is_zero(b):
            return left
        if fits(left, right):
            return common(left, right)
        label = f"`{operator}` joins `{left.shown}` and `{right.shown}`"
        hint = angle_hint(left, right)
        for tree, other in ((a, right), (b, left)):
            if isinstance(tree, Number) and tree.unit is NO_UNIT:
                hint = hint or units_hint(other)
        self.report("dimension", span, label, hint)
        return None

    def _relation(self, tree: Relation) -> Truthful:
        first, second = self.kind(tree.left), self.kind(tree.right)
        equality = tree.operator in ("==", "!=")
        if wholes_of(tree.left, first, tree.right, second):
            return "truth"
        named = [kind for kind in (first, second) if isinstance(kind, str | Enumeration)]
        if equality and (first is None or second is None):
            return "truth"
        if equality and len(named) == 2:
            if first != second:
                label = f"`{tree.operator}` compares {said(named[0])} and {said(named[1])}"
                self.report("type", tree.span, label)
            return "truth"
        if equality and "truth" in (first, second):
            condition = tree.left if first == "truth" else tree.right
            label = "this is true or false, a quantity is needed"
            self.report("type", condition.span, label, compared_hint(tree, condition))
            return "truth"
        left, right = self.number(first, tree.left), self.number(second, tree.right)
        if left is None or right is None:
            return "truth"
        if equality:
            label = f"`{tree.operator}` is not for real numbers"
            self.report("type", tree.span, label, "use `<=` or `>=`")
        else:
            self.together(tree.left, left, tree.right, right, tree.span, tree.operator)
        return "truth"

    def _choice(self, tree: Choice) -> Kind | None:
        self.truth(tree.condition, "if")
        first, second = self.kind(tree.then), self.kind(tree.other)
        if first is None or second is None:
            return None
        wholes = wholes_of(tree.then, first, tree.other, second)
        if wholes:
            return wholes[0].joined(wholes[1])
        left, right = as_real(first), as_real(second)
        if isinstance(left, Dimension) and isinstance(right, Dimension):
            return self.together(tree.then, left, tree.other, right, tree.span, "if")
        if left != right:
            label = f"one arm is {said(first)}, the other {said(second)}"
            if "truth" in (left, right) and Dimension in (type(left), type(right)):
                label = "one arm is a condition, the other a quantity"
            self.report("type", tree.span, label)
            return None
        return left
