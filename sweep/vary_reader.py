"""Vary reader: the sections `vary` and `set` of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from language.difference import HINT, LABEL, difference
from language.dimension import DimensionCheck
from language.document import Entry, Items, Node
from language.experiment import System
from language.kind import Kind
from language.names import check_name
from language.problem import Problems, Span, nearest
from language.reader import Reader
from language.scope import Scope
from language.syntax import Number
from language.units import NO_UNIT, Unit
from sweep.shape import fault_of_shape, log_spaced
from sweep.study import Axis, Distribution, Setting, Shape, Target, Varied
from sweep.target import Place

LISTS = ("values", "linspace", "logspace")
SHAPES: tuple[Shape, ...] = ("uniform", "log_uniform", "normal", "lognormal", "choice")
OPTIONS = ("within", "weights")
MOST_ON_AXIS = 100_000


class VaryReader(Reader):
    """What varies and where it goes; `places` are what names of the study may mean."""

    def __init__(self, problems: Problems, places: Mapping[str, Place], system: System) -> None:
        """Read against the places of the study's systems and scenarios."""
        super().__init__(problems)
        self.places = places
        self.system = system
        self.taken: dict[Target, Span] = {}
        self.kinds: dict[str, Kind] = {}

    def varied(self, node: Node | None) -> tuple[Varied, ...]:
        """Return what varies, in the order of the file."""
        found = []
        for entry in self.table(node, "vary"):
            with self.problems.collecting():
                varied = self._varied(entry)
                if varied:
                    found.append(varied)
        return tuple(found)

    def _varied(self, entry: Entry) -> Varied | None:
        place = self.places.get(entry.key)
        if place is None and "." in entry.key:
            self._unknown(entry)
            return None
        if place is None:
            check_name(entry.key, entry.span, self.problems)
        else:
            self._take(place.targets, entry.span)
        course, unit = self._course(entry, place)
        if course is None:
            return None
        if place and place.type != "real" and not _is_list(course):
            label = f"`{entry.key}` is {place.type}: it has `values` or a `choice`"
            self.problems.error("type", entry.span, label)
        self.kinds[entry.key] = unit.dimension
        words = place.values if place else ()
        if place and place.type == "bool":
            words = ("false", "true")
        targets = place.targets if place else ()
        return Varied(entry.key, course, targets, unit, entry.span, words)

    def _unknown(self, entry: Entry) -> None:
        label = f"`{entry.key}` is nothing that can vary here"
        hint = nearest(entry.key, self.places)
        if not hint:
            hint = "a parameter, `initial.<instance>.<state>`, `inputs.<name>.<part>`, a sensor's"
        self.problems.error("name", entry.span, label, hint)

    def _take(self, targets: Sequence[Target], span: Span) -> None:
        """Each place has one value: two that give it are a problem."""
        for target in targets:
            first = self.taken.setdefault(target, span)
            if first is not span:
                label = f"`{'.'.join(target.path)}` has two values in each variant"
                self.problems.error("duplicate", span, label, f"the other one is at {first}")
                return

    def _course(self, entry: Entry, place: Place | None) -> tuple[Axis | Distribution | None, Unit]:
        first = place.unit if place else None
        told = len(self.problems.found)
        if isinstance(entry.node, Items):
            numbers, unit = self._numbers(entry.node, entry.key, first, place)
            return self._axis(numbers, entry.span, told), unit
        table = self.table(entry.node, f"vary.{entry.key}", (*LISTS, *SHAPES, *OPTIONS))
        forms = [key for key in table.entries if key in (*LISTS, *SHAPES)]
        if len(forms) != 1:
            if len(self.problems.found) == told:
                span = table.entries[forms[1]].span if forms else entry.span
                label = f"`{entry.key}` varies in one way"
                self.problems.error("form", span, label, f"one of {', '.join((*LISTS, *SHAPES))}")
            return None, first or NO_UNIT
        form = forms[0]
        node = table.get(form)
        if form == "linspace" or form == "logspace":
            return self._spaced(node, form, first, place)
        numbers, unit = self._numbers(node, form, first, place)
        if form == "values":
            return self._axis(numbers, entry.span, told), unit
        within = self._within(table.get("within"), unit, form, place)
        weights = tuple(float(w) for w in self._plain(table.get("weights"), "weights"))
        shape = Distribution(form, tuple(map(_real, numbers)), within, weights)  # type: ignore[arg-type]
        if len(self.problems.found) == told:
            fault = fault_of_shape(shape)
            if fault:
                kind, label = fault
                self.problems.error(kind, table.entries[form].span, label)
        return shape, unit

    def _axis(self, numbers: Sequence[Fraction], span: Span, told: int) -> Axis:
        """Return an axis; one of which a value could not be read has no other fault."""
        if len(set(numbers)) < len(numbers) and len(self.problems.found) == told:
            self.problems.error("duplicate", span, "a value stands in the list twice")
        return Axis(tuple(map(_real, numbers)))

    def _numbers(
        self, node: Node | None, what: str, unit: Unit | None, place: Place | None
    ) -> tuple[list[Fraction], Unit]:
        """Return literals in SI and their unit; the second of a normal is a width."""
        found: list[Fraction] = []
        if isinstance(node, Items) and not node.nodes:
            self.problems.error("missing", node.span, f"`{what}` has at least one value")
        for item in self.items(node, what):
            is_second = what in ("normal", "lognormal") and len(found) == 1
            if is_second and what == "lognormal":
                found += self._plain(Items((item,), item.span), what)
            elif place and place.type != "real":
                unit = place.unit
                found.append(self.value(item, what, item.span, unit, place.type, place.values))
            elif unit and (is_second or (place and place.is_width)):
                found.append(difference(self, item, what, item.span, unit))
            else:
                value, own = self.quantity(item, what, item.span, unit)
                unit = unit or own
                found.append(value)
                self._in_range(value, item.span, place)
        return found, unit or NO_UNIT

    def _in_range(self, value: Fraction, span: Span, place: Place | None) -> None:
        limits = (place.low, place.high) if place else (None, None)
        if limits[0] is not None and limits[1] is not None and not limits[0] <= value <= limits[1]:
            assert place is not None
            label = f"this is outside the range of `{place.targets[0].path[-1]}`"
            self.problems.error("range", span, label, "a wider `range` where it is declared")

    def _spaced(
        self, node: Node | None, form: str, unit: Unit | None, place: Place | None
    ) -> tuple[Axis | None, Unit]:
        items = self.items(node, form)
        if len(items) != 3:
            if isinstance(node, Items):
                label = f"`{form}` is `[first, last, number]`"
                self.problems.error("form", node.span, label)
            return None, unit or NO_UNIT
        (first, last), unit = self._numbers(
            Items(tuple(items[:2]), items[0].span), form, unit, place
        )
        count = self.whole(items[2], "number", 2, 2, MOST_ON_AXIS)
        if form == "logspace":
            if first <= 0 or last <= 0:
                self.problems.error("range", items[0].span, "`logspace` is between two above zero")
                return None, unit
            return Axis(log_spaced(first, last, count)), unit
        steps = [first + (last - first) * Fraction(k, count - 1) for k in range(count)]
        return Axis(tuple(map(_real, steps))), unit

    def _plain(self, node: Node | None, what: str) -> list[Fraction]:
        """Return numbers without a unit."""
        found = []
        for item in self.items(node, what):
            value, unit = self.quantity(item, what, item.span, None)
            if not unit.dimension.is_number:
                self.problems.error("dimension", item.span, f"`{what}` has no unit here")
            found.append(value)
        return found

    def _within(
        self, node: Node | None, unit: Unit, form: str, place: Place | None
    ) -> tuple[float, float] | None:
        limits = self.range(node, unit) if node else None
        for item in self.items(node, "within") if limits and place and place.is_width else ():
            difference(self, item, "within", item.span, unit)
        if limits and form not in ("normal", "lognormal"):
            assert node is not None
            label = f"`within` cuts a normal or lognormal; `{form}` has its ends"
            self.problems.error("form", node.span, label)
        return (_real(limits[0]), _real(limits[1])) if limits else None

    # What follows from what varies.

    def settings(self, node: Node | None, varied: Sequence[Varied]) -> tuple[Setting, ...]:
        """Return the values that follow; report names that vary and go nowhere."""
        parameters = {
            name: place.unit.dimension
            for name, place in self.places.items()
            if place.targets[0].kind == "parameter" and place.type == "real"
        }
        for owner, instance in self.system.instances.items():
            for name, parameter in instance.automaton.parameters.items():
                if parameter.type == "real" and parameter.table is None:
                    parameters[f"{owner}.{name}"] = parameter.unit.dimension
        scope = Scope({**parameters, **self.kinds}, place="in `set`")
        found = []
        for entry in self.table(node, "set"):
            place = self.places.get(entry.key)
            if place is None:
                self._unknown(entry)
                continue
            self._take(place.targets, entry.span)
            formula = self.expression(entry.node, entry.key, entry.span)
            if formula:
                check = DimensionCheck(scope, self.problems)
                check.quantity(formula.tree, place.unit.dimension, entry.key)
                if place.is_width and isinstance(formula.tree, Number) and formula.tree.unit.offset:
                    self.problems.error("dimension", formula.span, LABEL, HINT)
                unit = str(place.unit.dimension)
                found.append(Setting(entry.key, place.targets, formula, unit))
        read = {name for setting in found for name in setting.formula.reads}
        for each in varied:
            if not each.targets and each.name not in read and not self.problems.has_errors:
                label = f"`{each.name}` is no parameter, and no `set` reads it"
                self.problems.error("name", each.span, label, nearest(each.name, self.places))
        return tuple(found)


def _is_list(course: Axis | Distribution) -> bool:
    return isinstance(course, Axis) or course.shape == "choice"


def _real(value: Fraction) -> float:
    return value.numerator / value.denominator
