"""Dimension check: the dimension of every expression, and what does not fit (rule 20)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

from language.call import WHERE, lookup_kind, memory_kind
from language.declaration import LookupTable
from language.kind import LARGEST_WHOLE, Enumeration, Kind, Truthful, Whole, combined
from language.problem import Problems, Span, nearest
from language.syntax import (
    MEMORY,
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
    whole_literal,
)
from language.units import (
    NUMBER,
    Dimension,
    Unit,
    common,
    fits,
    power,
    product,
    root,
    units_hint,
)

ANGLE = Dimension(angle=1)
SAME = {"abs": 1, "min": 2, "max": 2, "clip": 3}
"""Functions whose arguments and value have one dimension, with their number of arguments."""
NUMBERS = {"exp": 1, "tanh": 1, "floor": 1, "sign": 1}
ANGLES = {"sin": 1, "cos": 1, "tan": 1}
ARGUMENTS = {**SAME, **NUMBERS, **ANGLES, "sqrt": 1, "atan2": 2}
KNOWN = (*ARGUMENTS, *MEMORY, "lookup", "in", "der")


@dataclass(frozen=True)
class Scope:
    """What names mean at one place: their dimensions, and the modes that `in(...)` may name.

    `angles` are the units of the parameters that are declared in a unit of angle, `memory` the
    functions with memory that may be used, `tables` what `lookup` reads,
    `mode` the mode that reads, `owners` a mode for each equation that any mode has.
    """

    names: Mapping[str, Kind | None]
    modes: frozenset[str] = frozenset()
    place: str = "here"
    angles: Mapping[str, Unit] = field(default_factory=dict)
    memory: frozenset[str] = frozenset()
    tables: Mapping[str, LookupTable] = field(default_factory=dict)
    mode: str = ""
    owners: Mapping[str, str] = field(default_factory=dict)


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
        kind = _as_real(self.kind(tree))
        if isinstance(kind, str | Enumeration):
            label = f"`{what}` is a quantity, this is {_said(kind)}"
            self._report("type", tree.span, label)
        elif isinstance(kind, Dimension) and not _zero(tree) and not fits(kind, want):
            label = f"this is in `{kind}`, `{what}` is in `{want}`"
            hint = _angle_hint(kind, want)
            if isinstance(tree, Number | Negative):
                hint = hint or units_hint(want)
            self._report("dimension", tree.span, label, hint)

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
                label = f"`{what}` is a whole number, this is {_said(kind)}"
                self._report("type", tree.span, label, hint if isinstance(kind, Dimension) else "")

    def _same(self, tree: Tree, want: Kind, what: str) -> None:
        kind = self.kind(tree)
        if kind is not None and kind != want:
            label = f"`{what}` is {_said(want)}, this is {_said(kind)}"
            hint = "compare it: `x > 0`" if want == "truth" else ""
            self._report("type", tree.span, label, hint)

    def truth(self, tree: Tree, what: str) -> None:
        """Check that an expression is true or false."""
        kind = self.kind(tree)
        if kind is not None and kind != "truth":
            hint = "compare it: `x > 0`"
            label = f"`{what}` is a condition, this is {_said(kind)}"
            self._report("type", tree.span, label, hint)

    def kind(self, tree: Tree) -> Kind | None:
        """Return what the expression is, None where a problem was reported inside it."""
        match tree:
            case Broken():
                return None
            case Number(_, unit, _):
                return unit.dimension
            case Truth():
                return "truth"
            case Name():
                return self._name(tree)
            case Negative(operand, _):
                kind = self.kind(operand)
                if isinstance(kind, Whole):
                    return Whole(-kind.high, -kind.low)
                return self._number(kind, operand)
            case Not(operand, _):
                self.truth(operand, "not")
                return "truth"
            case Logic(operator, left, right, _):
                self.truth(left, operator)
                self.truth(right, operator)
                return "truth"
            case Arithmetic():
                return self._arithmetic(tree)
            case Relation():
                return self._relation(tree)
            case Power(base, exponent, _):
                kind = self._real(base)
                return None if kind is None else power(kind, exponent)
            case Choice():
                return self._choice(tree)
            case Application():
                return self._application(tree)

    def _report(self, kind: str, span: Span, label: str, help: str = "") -> None:
        self.problems.error(kind, span, label, help)

    def _real(self, tree: Tree) -> Dimension | None:
        return self._number(self.kind(tree), tree)

    def _number(self, kind: Kind | None, tree: Tree) -> Dimension | None:
        """What a whole number is in arithmetic of reals: a number without a unit."""
        kind = _as_real(kind)
        if isinstance(kind, Dimension):
            return kind
        if kind is not None:
            self._report("type", tree.span, f"this is {_said(kind)}, a quantity is needed")
        return None

    def _name(self, tree: Name) -> Kind | None:
        if tree.path in self.scope.tables:
            hint = f"read it with `lookup({tree.path}, ...)`"
            self._report("table", tree.span, f"`{tree.path}` is a table, not a value", hint)
            return None
        if tree.path in self.scope.names:
            return self.scope.names[tree.path]
        hint = nearest(tree.path, self.scope.names)
        owner = self.scope.owners.get(tree.path, self.scope.mode)
        if owner != self.scope.mode:
            hint = f"mode `{owner}` has an equation of it, mode `{self.scope.mode}` has none"
        self._report("name", tree.span, f"`{tree.path}` is not known {self.scope.place}", hint)
        return None

    def _arithmetic(self, tree: Arithmetic) -> Dimension | Whole | None:
        first, second = self.kind(tree.left), self.kind(tree.right)
        wholes = _wholes(tree.left, first, tree.right, second)
        if wholes and tree.operator != "/":
            return self._safe(combined(tree.operator, *wholes), tree)
        left, right = self._number(first, tree.left), self._number(second, tree.right)
        if left is None or right is None:
            return None
        if tree.operator in "*/":
            return product(left, right, 1 if tree.operator == "*" else -1)
        for part in (tree.left, tree.right):
            if isinstance(part, Number) and part.unit.offset:
                label = "a temperature in degC is not added or subtracted"
                self._report("dimension", part.span, label, "write a difference in K")
        self._one_unit_of_angle(tree)
        return self._together(tree.left, left, tree.right, right, tree.span, tree.operator)

    def _one_unit_of_angle(self, tree: Arithmetic) -> None:
        """Two declared numbers in `deg` and `rad` are not added: rule 20, nothing is converted."""
        known = self.scope.angles
        first, second = (
            known.get(part.path) if isinstance(part, Name) else None
            for part in (tree.left, tree.right)
        )
        if first and second and first.factor != second.factor:
            label = f"`{tree.operator}` joins `{first.text}` and `{second.text}`"
            self._report("dimension", tree.span, label, "declare both in one unit of angle")

    def _safe(self, kind: Whole, tree: Arithmetic) -> Whole:
        """Whole numbers are held in 32 bits: what may not fit is a problem."""
        if kind.is_safe:
            return kind
        label = f"this may lie from {kind.low} to {kind.high}: past {LARGEST_WHOLE}"
        hint = "give the whole numbers in it a narrower `range`"
        self._report("overflow", tree.span, label, hint)
        return Whole()

    def _together(
        self, a: Tree, left: Dimension, b: Tree, right: Dimension, span: Span, operator: str
    ) -> Dimension | None:
        if _zero(a):
            return right
        if _zero(b):
            return left
        if fits(left, right):
            return common(left, right)
        label = f"`{operator}` joins `{left}` and `{right}`"
        self._report("dimension", span, label, _angle_hint(left, right))
        return None

    def _relation(self, tree: Relation) -> Truthful:
        first, second = self.kind(tree.left), self.kind(tree.right)
        equality = tree.operator in ("==", "!=")
        if _wholes(tree.left, first, tree.right, second):
            return "truth"
        if equality and (first is None or second is None):
            return "truth"
        if equality and first == second and isinstance(first, str | Enumeration):
            return "truth"
        named = [kind for kind in (first, second) if isinstance(kind, str | Enumeration)]
        if equality and len(named) == 2:
            label = f"`{tree.operator}` compares {_said(named[0])} and {_said(named[1])}"
            self._report("type", tree.span, label)
            return "truth"
        left, right = self._number(first, tree.left), self._number(second, tree.right)
        if left is None or right is None:
            return "truth"
        if equality:
            label = f"`{tree.operator}` is not for real numbers"
            self._report("type", tree.span, label, "use `<=` or `>=`")
        else:
            self._together(tree.left, left, tree.right, right, tree.span, tree.operator)
        return "truth"

    def _choice(self, tree: Choice) -> Kind | None:
        self.truth(tree.condition, "if")
        first, second = self.kind(tree.then), self.kind(tree.other)
        if first is None or second is None:
            return None
        wholes = _wholes(tree.then, first, tree.other, second)
        if wholes:
            return wholes[0].joined(wholes[1])
        left, right = _as_real(first), _as_real(second)
        if isinstance(left, Dimension) and isinstance(right, Dimension):
            return self._together(tree.then, left, tree.other, right, tree.span, "if")
        if left != right:
            label = f"one arm is {_said(first)}, the other {_said(second)}"
            if "truth" in (left, right) and Dimension in (type(left), type(right)):
                label = "one arm is a condition, the other a quantity"
            self._report("type", tree.span, label)
            return None
        return left

    def _application(self, tree: Application) -> Kind | None:
        name, arguments = tree.function, tree.arguments
        if name == "in":
            return self._in(tree)
        if name in WHERE:
            return memory_kind(self, tree)
        if name == "lookup":
            return lookup_kind(self, tree)
        wanted = ARGUMENTS.get(name)
        if wanted is None:
            label = f"`{name}` is not a function that can be used here"
            usable = (*ARGUMENTS, *sorted(self.scope.memory), "lookup")
            hint = nearest(name, KNOWN) or f"there are `{' '.join(usable)}`"
            self._report("name", tree.span, label, hint)
            return None
        if len(arguments) != wanted:
            label = f"`{name}` takes {wanted} argument(s), not {len(arguments)}"
            self._report("arguments", tree.span, label)
            return None
        kinds = [self._real(argument) for argument in arguments]
        if any(kind is None for kind in kinds):
            return None
        return self._function(tree, [kind for kind in kinds if kind is not None])

    def _function(self, tree: Application, kinds: list[Dimension]) -> Dimension | None:
        name, first = tree.function, kinds[0]
        if name in SAME or name == "atan2":
            base: Tree = tree.arguments[0]
            sum_so_far: Dimension = first
            for argument, kind in zip(tree.arguments[1:], kinds[1:], strict=True):
                joined = self._together(base, sum_so_far, argument, kind, tree.span, name)
                if joined is None:
                    return None
                base, sum_so_far = (argument if _zero(base) else base), joined
            return ANGLE if name == "atan2" else sum_so_far
        if name == "sqrt":
            result = root(first)
            if result is None:
                self._report("dimension", tree.span, f"`{first}` has no square root")
            return result
        if name == "sign":
            return NUMBER
        fine = first.is_bare and (first.angle is None or first.angle == (name in ANGLES))
        if not fine and not _zero(tree.arguments[0]):
            want = "an angle" if name in ANGLES else "a number"
            self._report("dimension", tree.span, f"`{name}` takes {want}, this is in `{first}`")
        return NUMBER

    def _in(self, tree: Application) -> Truthful:
        name = tree.arguments[0]
        if not isinstance(name, Name) or name.path not in self.scope.modes:
            shown = name.path if isinstance(name, Name) else "..."
            label = f"`in({shown})` does not name a mode of the run of this mode or of a region"
            hint = nearest(shown, self.scope.modes)
            self._report("name", tree.span, label, hint)
        return "truth"


def _zero(tree: Tree) -> bool:
    """A bare 0 goes with any dimension."""
    return isinstance(tree, Number) and tree.is_bare_zero


def _as_real(kind: Kind | None) -> Kind | None:
    return NUMBER if isinstance(kind, Whole) else kind


def _wholes(
    a: Tree, first: Kind | None, b: Tree, second: Kind | None
) -> tuple[Whole, Whole] | None:
    """Return both as whole numbers where one is, and the other is too or is a literal like `2`."""
    if isinstance(first, Whole) and isinstance(second, Whole):
        return first, second
    if isinstance(first, Whole) and (value := whole_literal(b)) is not None:
        return first, Whole(value, value)
    if isinstance(second, Whole) and (value := whole_literal(a)) is not None:
        return Whole(value, value), second
    return None


def _said(kind: Kind) -> str:
    if kind == "truth":
        return "true or false"
    if isinstance(kind, Enumeration):
        return f"one of {', '.join(kind.values)}"
    return "a whole number" if isinstance(kind, Whole) else "a quantity"


def _angle_hint(left: Dimension, right: Dimension) -> str:
    if left.powers != right.powers:
        return ""
    if left.is_bare and 0 in (left.angle, right.angle):
        return "give the unit of the angle: `0.02 rad`, `3 deg`"
    return "they differ in the power of the angle (rad)"
