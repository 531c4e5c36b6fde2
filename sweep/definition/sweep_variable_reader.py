"""Vary reader: read the sections `vary` and `set` of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from language.expressions.name_rules import check_name
from language.expressions.syntax_tree import NumberLiteral
from language.expressions.units import NO_UNIT, Unit
from language.model.system import System
from language.readers.base_reader import Reader
from language.readers.difference_literal import HINT, LABEL, read_difference
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Entry, SequenceNode, YamlNode
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import ExprType
from sweep.definition.assignment_target import TargetInfo
from sweep.definition.distribution_check import fault_of_distribution, log_spaced
from sweep.definition.study import Axis, Distribution, Setting, Shape, SweepVariable, Target

AXIS_FORMS = ("values", "linspace", "logspace")
"""The forms of a grid axis."""
DISTRIBUTION_FORMS: tuple[Shape, ...] = ("uniform", "log_uniform", "normal", "lognormal", "choice")
"""The forms of a random variable."""
DISTRIBUTION_OPTIONS = ("within", "weights")
"""The keys beside the form of a distribution."""
MAX_AXIS_VALUES = 100_000
"""Largest number of values of `linspace` and `logspace`."""


class VaryReader(Reader):
    """Reader of variables and settings; `places` are the targets by name.

    `taken` holds the targets that have a value already, with the place of the assignment.
    """

    def __init__(
        self, problems: Problems, places: Mapping[str, TargetInfo], system: System
    ) -> None:
        """Read names with the targets of the study's systems and scenarios."""
        super().__init__(problems)
        self.places = places
        self.system = system
        self.assigned_targets: dict[Target, Span] = {}
        self.kinds: dict[str, ExprType] = {}

    def variables(self, node: YamlNode | None) -> tuple[SweepVariable, ...]:
        """Return the valid variables of the section `vary` in file order; reports the others.

        A name is a target or a new name without dots, to which `set` may refer. A target with two
        values is reported. None gives no variables.
        """
        found = []
        for entry in self.read_mapping(node, "vary"):
            with self.problems.collect_errors():
                varied = self._variable(entry)
                if varied:
                    found.append(varied)
        return tuple(found)

    def _variable(self, entry: Entry) -> SweepVariable | None:
        """Return the variable of an entry; None if a problem was reported."""
        place = self.places.get(entry.key)
        if place is None and "." in entry.key:
            self._report_unknown(entry)
            return None
        if place is None:
            check_name(entry.key, entry.span, self.problems)
        else:
            self._claim_targets(place.targets, entry.span)
        course, unit = self._distribution(entry, place)
        if course is None:
            return None
        if place and place.type != "real" and not _is_discrete(course):
            label = f"`{entry.key}` is {place.type}: it has `values` or a `choice`"
            self.problems.error("type", entry.span, label)
        self.kinds[entry.key] = unit.dimension
        words = place.values if place else ()
        if place and place.type == "bool":
            words = ("false", "true")
        targets = place.targets if place else ()
        return SweepVariable(entry.key, course, targets, unit, entry.span, words)

    def _report_unknown(self, entry: Entry) -> None:
        """Report a name that is no target, with the most similar name as hint."""
        label = f"`{entry.key}` is nothing that can vary here"
        hint = suggest_name(entry.key, self.places)
        if not hint:
            hint = "a parameter, `initial.<instance>.<state>`, `inputs.<name>.<part>`, a sensor's"
        self.problems.error("name", entry.span, label, hint)

    def _claim_targets(self, targets: Sequence[Target], span: Span) -> None:
        """Record that targets get a value; report a target that has one already."""
        for target in targets:
            first = self.assigned_targets.setdefault(target, span)
            if first is not span:
                label = f"`{'.'.join(target.path)}` has two values in each variant"
                self.problems.error("duplicate", span, label, f"the other one is at {first}")
                return

    def _distribution(
        self, entry: Entry, place: TargetInfo | None
    ) -> tuple[Axis | Distribution | None, Unit]:
        """Return axis or distribution of an entry, and its unit.

        The first is None if the form is missing, ambiguous or invalid. Other problems are reported
        only.
        """
        first = place.unit if place else None
        problem_count = len(self.problems.reported)
        if isinstance(entry.node, SequenceNode):
            numbers, unit = self._numbers(entry.node, entry.key, first, place)
            return self._axis(numbers, entry.span, problem_count), unit
        table = self.read_mapping(
            entry.node,
            f"vary.{entry.key}",
            (*AXIS_FORMS, *DISTRIBUTION_FORMS, *DISTRIBUTION_OPTIONS),
        )
        forms = [key for key in table.entries if key in (*AXIS_FORMS, *DISTRIBUTION_FORMS)]
        if len(forms) != 1:
            if len(self.problems.reported) == problem_count:
                span = table.entries[forms[1]].span if forms else entry.span
                label = f"`{entry.key}` varies in one way"
                self.problems.error(
                    "form", span, label, f"one of {', '.join((*AXIS_FORMS, *DISTRIBUTION_FORMS))}"
                )
            return None, first or NO_UNIT
        form = forms[0]
        node = table.get(form)
        if form == "linspace" or form == "logspace":
            return self._spaced_axis(node, form, first, place)
        numbers, unit = self._numbers(node, form, first, place)
        if form == "values":
            return self._axis(numbers, entry.span, problem_count), unit
        within = self._truncation(table.get("within"), unit, form, place)
        weights = tuple(float(w) for w in self._plain_numbers(table.get("weights"), "weights"))
        shape = Distribution(form, tuple(map(float, numbers)), within, weights)  # type: ignore[arg-type]
        if len(self.problems.reported) == problem_count:
            fault = fault_of_distribution(shape)
            if fault:
                kind, label = fault
                self.problems.error(kind, table.entries[form].span, label)
        return shape, unit

    def _axis(self, numbers: Sequence[Fraction], span: Span, problem_count: int) -> Axis:
        """Return an axis; report duplicate values unless an earlier problem was reported."""
        if len(set(numbers)) < len(numbers) and len(self.problems.reported) == problem_count:
            self.problems.error("duplicate", span, "a value stands in the list twice")
        return Axis(tuple(map(float, numbers)))

    def _numbers(
        self, node: YamlNode | None, what: str, unit: Unit | None, place: TargetInfo | None
    ) -> tuple[list[Fraction], Unit]:
        """Return literals as SI values, and their unit.

        The second number of a normal is a difference, that of a lognormal has no unit.
        """
        found: list[Fraction] = []
        if isinstance(node, SequenceNode) and not node.nodes:
            self.problems.error("missing", node.span, f"`{what}` has at least one value")
        for item in self.read_list(node, what):
            is_second = what in ("normal", "lognormal") and len(found) == 1
            if is_second and what == "lognormal":
                found += self._plain_numbers(SequenceNode((item,), item.span), what)
            elif place and place.type != "real":
                unit = place.unit
                found.append(
                    self.read_typed_value(item, what, item.span, unit, place.type, place.values)
                )
            elif unit and (is_second or (place and place.is_width)):
                found.append(read_difference(self, item, what, item.span, unit))
            else:
                value, own = self.read_quantity(item, what, item.span, unit)
                unit = unit or own
                found.append(value)
                self._require_in_range(value, item.span, place)
        return found, unit or NO_UNIT

    def _require_in_range(self, value: Fraction, span: Span, place: TargetInfo | None) -> None:
        """Report a value [SI] outside the declared range of its parameter."""
        limits = (place.low, place.high) if place else (None, None)
        if limits[0] is not None and limits[1] is not None and not limits[0] <= value <= limits[1]:
            assert place is not None
            label = f"this is outside the range of `{place.targets[0].path[-1]}`"
            self.problems.error("range", span, label, "a wider `range` where it is declared")

    def _spaced_axis(
        self, node: YamlNode | None, form: str, unit: Unit | None, place: TargetInfo | None
    ) -> tuple[Axis | None, Unit]:
        """Return the axis of `linspace` or `logspace` and its unit; None after a problem."""
        items = self.read_list(node, form)
        if len(items) != 3:
            if isinstance(node, SequenceNode):
                label = f"`{form}` is `[first, last, number]`"
                self.problems.error("form", node.span, label)
            return None, unit or NO_UNIT
        (first, last), unit = self._numbers(
            SequenceNode(tuple(items[:2]), items[0].span), form, unit, place
        )
        count = self.read_integer(items[2], "number", 2, 2, MAX_AXIS_VALUES)
        if form == "logspace":
            if first <= 0 or last <= 0:
                self.problems.error("range", items[0].span, "`logspace` is between two above zero")
                return None, unit
            return Axis(log_spaced(first, last, count)), unit
        steps = [first + (last - first) * Fraction(k, count - 1) for k in range(count)]
        return Axis(tuple(map(float, steps))), unit

    def _plain_numbers(self, node: YamlNode | None, what: str) -> list[Fraction]:
        """Return numbers without a unit; reports those with a unit."""
        found = []
        for item in self.read_list(node, what):
            value, unit = self.read_quantity(item, what, item.span, None)
            if not unit.dimension.is_number:
                self.problems.error("dimension", item.span, f"`{what}` has no unit here")
            found.append(value)
        return found

    def _truncation(
        self, node: YamlNode | None, unit: Unit, form: str, place: TargetInfo | None
    ) -> tuple[float, float] | None:
        """Return the bounds `within` [SI]; None without.

        Reports bounds of other distributions than normal and lognormal.
        """
        limits = self.read_range(node, unit) if node else None
        for item in self.read_list(node, "within") if limits and place and place.is_width else ():
            read_difference(self, item, "within", item.span, unit)
        if limits and form not in ("normal", "lognormal"):
            assert node is not None
            label = f"`within` cuts a normal or lognormal; `{form}` has its ends"
            self.problems.error("form", node.span, label)
        return (float(limits[0]), float(limits[1])) if limits else None

    def settings(
        self, node: YamlNode | None, variables: Sequence[SweepVariable]
    ) -> tuple[Setting, ...]:
        """Return the assignments of the section `set`, checked for types and dimensions.

        `variables` are those of the section `vary`, which must be read first. Unknown targets and
        those that have a value already are reported. Reports variables that have no target and
        appear in no setting, unless there are other errors.
        """
        parameters = {
            name: place.unit.dimension
            for name, place in self.places.items()
            if place.targets[0].kind == "parameter" and place.type == "real"
        }
        for owner, instance in self.system.instances.items():
            for name, parameter in instance.automaton.parameters.items():
                if parameter.type == "real" and parameter.table is None:
                    parameters[f"{owner}.{name}"] = parameter.unit.dimension
        scope = NameEnvironment({**parameters, **self.kinds}, location="in `set`")
        found = []
        for entry in self.read_mapping(node, "set"):
            place = self.places.get(entry.key)
            if place is None:
                self._report_unknown(entry)
                continue
            self._claim_targets(place.targets, entry.span)
            formula = self.read_expression(entry.node, entry.key, entry.span)
            if formula:
                check = TypeChecker(scope, self.problems)
                check.check_quantity(formula.tree, place.unit.dimension, entry.key)
                if (
                    place.is_width
                    and isinstance(formula.tree, NumberLiteral)
                    and formula.tree.unit.offset
                ):
                    self.problems.error("dimension", formula.span, LABEL, HINT)
                unit = str(place.unit.dimension)
                found.append(Setting(entry.key, place.targets, formula, unit))
        read = {name for setting in found for name in setting.formula.reads}
        for each in variables:
            if not each.targets and each.name not in read and not self.problems.has_errors:
                label = f"`{each.name}` is no parameter, and no `set` reads it"
                self.problems.error("name", each.span, label, suggest_name(each.name, self.places))
        return tuple(found)


def _is_discrete(distribution: Axis | Distribution) -> bool:
    """Return whether a variable has a finite list of values."""
    return isinstance(distribution, Axis) or distribution.shape == "choice"
