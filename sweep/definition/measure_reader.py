"""Measure reader: read the section `measures` of a study and check it against the systems."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from fractions import Fraction

from language.expressions.syntax_tree import Name
from language.expressions.text_rewrite import names_in_text, rename_names
from language.expressions.units import (
    PURE_NUMBER,
    SECOND,
    Dimension,
    Unit,
    are_compatible,
    dimension_product,
)
from language.loading.mode_entry_event import ModeEntryEvent, read_event
from language.loading.signal_types import signal_types
from language.model.declaration import Formula
from language.model.system import System
from language.readers.base_reader import Reader
from language.readers.difference_literal import read_difference
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import ExprType, IntType
from sweep.definition.measure import (
    Bound,
    DelayMeasure,
    EventMeasure,
    MatchMeasure,
    Measure,
    SignalKind,
    SignalMeasure,
    ValueMeasure,
    columns_of,
)

WINDOW_KEYS = ("from", "until")
SIGNAL_KINDS: tuple[SignalKind, ...] = (
    "peak", "max", "min", "mean", "rms", "final", "settling", "frequency",
)  # fmt: skip
MEASURE_KEYS: dict[str, tuple[str, ...]] = {
    "time": ("number", *WINDOW_KEYS),
    "count": WINDOW_KEYS,
    "delay": ("after", "number", "before", "within", *WINDOW_KEYS),
    "match": ("truth", "before", "within", *WINDOW_KEYS),
    **{kind: WINDOW_KEYS for kind in SIGNAL_KINDS},
    "settling": ("within", *WINDOW_KEYS),
    "frequency": ("by", *WINDOW_KEYS),
    "value": WINDOW_KEYS,
    "is": WINDOW_KEYS,
}
"""The keys beside each kind of measure. A window of `value` or `is` is refused with its own
message.
"""
VALUE_KINDS = ("value", "is")
"""Kinds of measures that are expressions of other measures."""
MAX_EVENTS = 1_000_000
"""Largest event number of a measure."""


class MeasureReader(Reader):
    """Reader of measures in their order; a measure may refer to earlier ones.

    `dimensions` holds the type of each column read so far, None for a measure with a problem.
    `expressions` holds the expressions of signals by the name of their additional output.
    """

    def __init__(self, problems: Problems, systems: Sequence[System]) -> None:
        """Check names against all systems of the study; the first system gives the units."""
        super().__init__(problems)
        self.systems = systems
        self.dimensions: dict[str, ExprType | None] = {}
        self.expressions: dict[str, tuple[Formula, Dimension]] = {}

    def measures(self, node: YamlNode | None, at: Span) -> tuple[Measure, ...]:
        """Return the valid measures of a section in their order; report the problems of the others.

        A missing or empty section is reported at `at`. An event, signal or expression must be valid
        in all systems. Later references to an invalid measure are not reported again. Fills
        `dimensions` and `expressions`.
        """
        found = []
        for entry in self.named_entries(node, "measures"):
            measure = self._measure(entry)
            self.dimensions[entry.key] = (
                None  # None suppresses further reports about a faulty measure
            )
            if measure:
                del self.dimensions[entry.key]
                found.append(measure)
                for column in columns_of(measure):
                    if column.type == "truth":
                        self.dimensions[column.name] = "truth"
                    elif column.type != "list":
                        self.dimensions[column.name] = self._dimension(measure, column.unit)
        if node is None or (isinstance(node, MappingNode) and not node.entries):
            self.problems.error("missing", at, "a study has `measures`", "like `{final: plant.w}`")
        return tuple(found)

    def _dimension(self, measure: Measure, unit: str) -> Dimension:
        """Return the dimension of a column of a measure."""
        if isinstance(measure, SignalMeasure | ValueMeasure):
            return self._last_dimension
        return SECOND if unit == "s" else PURE_NUMBER

    def _measure(self, entry: Entry) -> Measure | None:
        """Return the measure of an entry; None if a problem was reported."""
        found = self.read_alternative(entry, f"measures.{entry.key}", MEASURE_KEYS, "measures")
        if found is None:
            return None
        kind, own = found
        scalar = self.read_scalar(own.get(kind), kind, entry.span)
        if scalar is None:
            return None
        if kind in VALUE_KINDS:
            for key in WINDOW_KEYS:
                if key in own.entries:
                    label = f"`{kind}` reads measures: it has no window"
                    self.problems.error("form", own.entries[key].span, label)
            return self._value(entry, scalar, kind == "is")
        since, until = (self._bound(own.get(key), key) for key in WINDOW_KEYS)
        if kind in SIGNAL_KINDS:
            return self._signal(entry, kind, scalar, own, since, until)
        return self._event(entry, kind, scalar, own, since, until)

    def _bound(self, node: YamlNode | None, what: str) -> Bound:
        """Return a bound of a window: a time [s], an earlier measure that is a time, or None."""
        if node is None:
            return None
        if isinstance(node, ScalarNode) and not node.text[:1].isdecimal():
            kind = self.dimensions.get(node.text)
            if isinstance(kind, Dimension) and are_compatible(kind, SECOND):
                return node.text
            if kind is None and node.text in self.dimensions:
                return None
            label = f"`{node.text}` is not an earlier measure that is a time"
            self.problems.error("name", node.span, label, suggest_name(node.text, self.dimensions))
            return None
        return self.read_duration(node, what)

    def _event(
        self,
        entry: Entry,
        kind: str,
        scalar: ScalarNode,
        own: MappingNode,
        since: Bound,
        until: Bound,
    ) -> Measure | None:
        """Return a measure of events (time, count, delay or match).

        Return None if a problem was reported.
        """
        event = self._event_name(scalar)
        if event is None:
            return None
        number = self.read_integer(own.get("number"), "number", 1, 1, MAX_EVENTS)
        if kind in ("time", "count"):
            unit = "s" if kind == "time" else "1"
            return EventMeasure(
                entry.key, kind, event, number, since, until, unit, entry.span  # type: ignore[arg-type]
            )  # fmt: skip
        other = self.read_scalar(
            own.get("after" if kind == "delay" else "truth"), "the other event", entry.span
        )
        truth = self._event_name(other) if other else None
        if truth is None:
            return None
        before = self.read_duration(own.get("before"), "before")
        within = self.read_duration(own.get("within"), "within") if own.get("within") else None
        if kind == "match":
            return MatchMeasure(
                entry.key, event, truth, before, within, since, until, "s", entry.span
            )
        return DelayMeasure(
            entry.key, event, truth, number, before, within, since, until, "s", entry.span
        )

    def _event_name(self, scalar: ScalarNode) -> ModeEntryEvent | None:
        """Return the event of a text if all systems have it; None if a problem was reported.

        Events of charts are refused, because their transitions do not determine all entries.
        """
        found = [read_event(scalar, system, self.problems) for system in self.systems]
        event = found[0] if all(found) else None
        for system in self.systems if event else ():
            assert event is not None
            if system.instances[event.instance].automaton.statechart is not None:
                label = (
                    f"`{event.instance}` is a chart: its transitions do not determine all entries"
                )
                hint = "a test of the spec does: docs/testing.md"
                self.problems.error("event", scalar.span, label, hint)
                return None
        return event

    def _signal(
        self,
        entry: Entry,
        kind: SignalKind,
        scalar: ScalarNode,
        own: MappingNode,
        since: Bound,
        until: Bound,
    ) -> Measure | None:
        """Return a statistic of a signal; None if a problem was reported."""
        signal, dimension = self._recorded_signal(entry.key, scalar)
        if dimension is None:
            return None
        unit = Unit(str(dimension), Fraction(1), dimension)
        within = Fraction(0)
        if kind == "settling":
            problem_count = len(self.problems.reported)
            within = read_difference(self, own.get("within"), "within", entry.span, unit)
            if within <= 0 and len(self.problems.reported) == problem_count:
                self.problems.error("range", entry.span, "`within` of `settling` is above zero")
        by = self.read_choice(own.get("by"), "by", ("crossings", "spectrum"), "crossings")
        self._last_dimension = dimension
        if kind in ("settling", "frequency"):
            self._last_dimension = (
                SECOND if kind == "settling" else dimension_product(PURE_NUMBER, SECOND, -1)
            )
        result_unit = str(self._last_dimension)
        return SignalMeasure(
            entry.key, kind, signal, since, until, float(within), by, result_unit, entry.span  # type: ignore[arg-type]
        )  # fmt: skip

    def _recorded_signal(self, name: str, scalar: ScalarNode) -> tuple[str, Dimension | None]:
        """Return the recorded signal of a text and its dimension.

        The dimension is None if a problem was reported. The text must be valid in all systems. A
        single instance in a system needs no prefix.
        """
        found: list[tuple[str, Dimension | None]] = []
        for system in self.systems:
            known = signal_types(system)
            text = scalar.text
            if system.sole_instance:
                short = {n.partition(".")[2]: n for n in known if "." in n}
                text = rename_names(
                    text, {n: full for n, full in short.items() if n in names_in_text(text)}
                )
            whole = scalar if text == scalar.text else dataclasses.replace(scalar, text=text)
            formula = self.read_expression(whole, name, scalar.span)
            if formula is None:
                return "", None
            if isinstance(formula.tree, Name) and formula.tree.path not in known:
                path = formula.tree.path
                label = f"`{path}` is not a signal of `{system.name}`"
                self.problems.error("name", scalar.span, label, suggest_name(path, known))
                return "", None
            with self.problems.collect_errors():
                check = TypeChecker(NameEnvironment(known, location="in a measure"), self.problems)
                kind = check.infer_type(formula.tree)
                found.append(self._named_signal(name, formula, kind, system))
        return found[0] if len(found) == len(self.systems) else ("", None)

    def _named_signal(
        self, name: str, formula: Formula, kind: ExprType | None, system: System
    ) -> tuple[str, Dimension | None]:
        """Return the name and the dimension of a signal, or of an expression as a new output."""
        if kind is None:
            return "", None
        if isinstance(kind, IntType):
            kind = PURE_NUMBER
        if not isinstance(kind, Dimension):
            self.problems.error("type", formula.span, "a signal that is measured is a quantity")
            return "", None
        if isinstance(formula.tree, Name):
            return formula.tree.path, kind
        self.expressions[f"measured_{name}"] = formula, kind
        return f"measured_{name}", kind

    def _value(self, entry: Entry, scalar: ScalarNode, is_truth: bool) -> Measure | None:
        """Return a measure that is an expression of earlier measures.

        Return None if a problem was reported.
        """
        formula = self.read_expression(scalar, entry.key, scalar.span)
        if formula is None:
            return None
        problem_count = len(self.problems.reported)
        check = TypeChecker(
            NameEnvironment(self.dimensions, location="among the measures before"), self.problems
        )
        kind = check.infer_type(formula.tree)
        if len(self.problems.reported) > problem_count or kind is None:
            return None
        if is_truth != (kind == "truth") or not (is_truth or isinstance(kind, Dimension)):
            label = f"`{entry.key}` is a quantity: `is` asks whether something is the case"
            if is_truth:
                label = f"`is` asks whether something is the case, and `{entry.key}` is a quantity"
            hint = "like `{value: 2 * late}` or `{is: late > 2 ms}`"
            self.problems.error("type", scalar.span, label, hint)
            return None
        self._last_dimension = kind if isinstance(kind, Dimension) else PURE_NUMBER
        return ValueMeasure(entry.key, formula, str(self._last_dimension), entry.span, is_truth)

    _last_dimension: Dimension = PURE_NUMBER
