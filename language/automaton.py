"""Automaton reader: an expanded document to an Automaton, all problems of form reported."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Literal, cast

from language.document import Document, Entry, Node, Scalar, Table
from language.element import ElementReader
from language.mode import ModeReader
from language.model import (
    Automaton,
    Fitting,
    Formula,
    Input,
    Kind,
    Parameter,
    Range,
    State,
)
from language.names import check_file_name
from language.number import NUMBERS, NumberType
from language.observer import METHODS
from language.overlay import lay, without
from language.problem import Problems, nearest
from language.project import Project, expanded, read_document
from language.reader import Reader
from language.region import with_regions
from language.syntax import Broken
from language.table import TableReader, section
from language.units import NO_UNIT, SECOND, Unit, fits, parse_unit
from language.values import with_value

COMMON_KEYS = ("language", "automaton", "parameters", "inputs", "states", "discrete", "equations")
LOGIC_KEYS = ("flow", "terms", "initial", "modes", "regions", "templates", "outputs")
LAID_KEYS = ("elements", "places")
CLOCK_KEYS = ("period", "step", "method", "numbers", "model")
FITTING_KEYS = ("neutral", "starts", "per", "form")
FORMS = ("constant", "constant_or_random_walk")
Per = Literal["model", "recording"]
Form = Literal["constant", "constant_or_random_walk"]
DEFAULT_STEP = Fraction(1, 1000)
"""Major step of a continuous automaton that gives none."""

Values = Mapping[str, Scalar]


def read_automaton(
    document: Document, project: Project, values: Values | None, problems: Problems
) -> Automaton:
    """Read an automaton or variant with some parameter values replaced.

    Problems of form are reported and reading goes on; SpecError where there is nothing to read.
    """
    document = expanded(document, project, problems)
    if document.kind != "automaton":
        label = f"`{document.name}` is a {document.kind}, not an automaton"
        problems.error("form", document.name_span, label)
    problems.stop_if_any()
    tree, model = _with_model(document.root, project, values or {}, problems)
    return _AutomatonReader(problems).read(document, tree, model)


def _with_model(
    tree: Table, project: Project, values: Values, problems: Problems
) -> tuple[Table, Automaton | None]:
    """Apply values; parameters that the model has go to the model, the rest stays."""
    node = tree.get("model")
    own = _parameters(tree)
    if not isinstance(node, Scalar):
        return _set_values(tree, own, values, own, problems), None
    base = expanded(read_document(project.path_of(node.text, node.span)), project, problems)
    if base.root.get("model") is not None:
        label = f"`{base.name}` has a `model` itself: a model is a continuous automaton"
        problems.error("model", node.span, label)
        problems.stop_if_any()
    theirs = _parameters(base.root)
    shared = {key: entry for key, entry in own.entries.items() if key in theirs.entries}
    laid = lay(theirs, Table(shared, own.span), problems, template=True)
    known = Table({**theirs.entries, **own.entries}, own.span)
    passed = {key: value for key, value in values.items() if key in theirs.entries}
    kept = {key: value for key, value in values.items() if key not in passed}
    root = _with(base.root, "parameters", laid)
    changed = Document(base.kind, base.name, base.name_span, root, base.source)
    model = read_automaton(changed, project, passed, problems)
    rest = without(own, *shared)
    return _set_values(_with(tree, "parameters", rest), rest, kept, known, problems), model


def _parameters(tree: Table) -> Table:
    node = tree.get("parameters")
    return node if isinstance(node, Table) else Table({}, tree.span)


def _with(tree: Table, key: str, node: Node) -> Table:
    span = tree.entries[key].span if key in tree.entries else tree.span
    return Table({**tree.entries, key: Entry(key, span, node)}, tree.span)


def _set_values(
    tree: Table, parameters: Table, values: Values, known: Table, problems: Problems
) -> Table:
    for name, value in values.items():
        entry = parameters.entries.get(name)
        if entry is None or not isinstance(entry.node, Table):
            label = f"there is no parameter `{name}`"
            problems.error("name", value.span, label, nearest(name, known.entries))
        elif "derived" in entry.node.entries:
            label = f"`{name}` is derived: its value follows from others"
            problems.error(
                "values", value.span, label, f"set what it follows from, given at {entry.span}"
            )
        else:
            parameters = _with(parameters, name, with_value(entry.node, value))
    return _with(tree, "parameters", parameters) if values else tree


class _AutomatonReader(Reader):
    """The sections of an automaton, one method each."""

    def read(self, document: Document, tree: Table, model: Automaton | None) -> Automaton:
        keys = (*COMMON_KEYS, *LOGIC_KEYS, *LAID_KEYS, *CLOCK_KEYS)
        tree = self.table(tree, f"automaton {document.name}", keys)
        self.at = document.name_span
        check_file_name(document.name, document.name_span, self.problems)
        self.model = model
        self.declared = (section(tree, "inputs"), section(tree, "states"))
        period = self._time(tree.get("period"), "period")
        self.sampled = period is not None
        numbers = self._numbers(tree)
        own = {e.key: self._parameter(e) for e in self.named(tree.get("parameters"), "parameters")}
        chart, *beside = ModeReader(self.problems, model).regions(tree, self.at)
        laid_on = ElementReader(self.problems)
        outputs = laid_on.outputs(tree.get("outputs"))
        automaton = Automaton(
            name=document.name,
            period=period,
            step=self._time(tree.get("step"), "step") or DEFAULT_STEP,
            method=self.choice(tree.get("method"), "method", METHODS, "rk4"),
            model=model,
            parameters={**(model.parameters if model else {}), **own},
            inputs={e.key: self._input(e) for e in self.named(tree.get("inputs"), "inputs")},
            states=self._states(tree),
            discrete=self._discrete(tree),
            modes=with_regions(chart.modes, tuple(beside)),
            initial=chart.initial,
            outputs=outputs.spans,
            span=document.name_span,
            sources=outputs.sources,
            elements=laid_on.elements(tree.get("elements")),
            places=laid_on.places(tree.get("places")),
            regions=tuple(beside),
            numbers=numbers,
        )
        self._check_sections(tree)
        return automaton

    def _numbers(self, tree: Table) -> NumberType:
        """A sampled automaton says what it computes in; a continuous one has float64 by default."""
        node = tree.get("numbers")
        if node is None and self.sampled:
            self.scalar(node, "numbers", self.at)
        return cast(NumberType, self.choice(node, "numbers", NUMBERS, "float64"))

    def _check_sections(self, tree: Table) -> None:
        for key in ("flow", "terms", "step", "method") if self.sampled else ("model",):
            node = tree.get(key)
            if node is not None:
                other = "continuous" if self.sampled else "sampled"
                label = f"`{key}` belongs to a {other} automaton"
                self.problems.error("form", tree.entries[key].span, label)

    def _time(self, node: Node | None, what: str) -> Fraction | None:
        if node is None:
            return None
        value, unit = self.quantity(node, what, node.span, None)
        if not fits(unit.dimension, SECOND):
            self.problems.error("dimension", node.span, f"`{what}` is a time, like `1 ms`")
        elif value <= 0:
            self.problems.error("range", node.span, f"`{what}` is above zero")
        else:
            return value
        return Fraction(1, 1000)

    def _parameter(self, entry: Entry) -> Parameter:
        own_keys = ("value", "unit", "range", "tunable", "derived", "type", "values", "table")
        keys = (*own_keys, *FITTING_KEYS)
        table = self.table(entry.node, f"parameters.{entry.key}", keys)
        if "table" in table.entries:
            return self._table_parameter(entry, table)
        type_, values = self.typing(table, entry.key)
        key = f"parameters.{entry.key}"
        unit_node = table.get("unit")
        unit: Unit | None = self.unit(unit_node) if unit_node else None
        tunable = self.choice(table.get("tunable"), "tunable", ("true", "false"), "false") == "true"
        kind: Kind = "tunable" if tunable else "fixed"
        value, derived = None, None
        if "derived" in table.entries:
            kind = "derived"
            derived = self.expression(table.get("derived"), f"{key}.derived", entry.span)
            for other in ("value", "tunable", "range", "type"):
                if other in table.entries:
                    label = f"a derived parameter has no `{other}`"
                    self.problems.error("form", table.entries[other].span, label)
        elif type_ != "real":
            node, what = table.get("value"), f"{key}.value"
            value = self.value(node, what, entry.span, NO_UNIT, type_, values)
        else:
            value, own = self.quantity(table.get("value"), f"{key}.value", entry.span, unit)
            unit = unit or own
        unit = unit or parse_unit("1")
        limits = self.range(table.get("range"), unit)
        if limits and value is not None and not limits[0] <= value <= limits[1]:
            place = cast(Scalar, table.get("value")).span
            self.problems.error("range", place, f"the value of `{entry.key}` is outside its range")
        if type_ == "int":
            limits = self.whole_range(limits, table.get("range"))
        fitting = self._fitting(table, unit, limits)
        at = entry.span
        return Parameter(
            entry.key, kind, unit, value, derived, limits, key, at, fitting, type_, values
        )

    def _table_parameter(self, entry: Entry, table: Table) -> Parameter:
        key = f"parameters.{entry.key}"
        for other in ("value", "derived", "unit", "type", "values", *FITTING_KEYS):
            if other in table.entries:
                label = f"a table has no `{other}` beside it"
                self.problems.error("form", table.entries[other].span, label)
        tunable = self.choice(table.get("tunable"), "tunable", ("true", "false"), "false")
        kind: Kind = "tunable" if tunable == "true" else "fixed"
        body = self.table(table.get("table"), f"{key}.table", ("over", "unit", "points"))
        unit = self.unit(body.get("unit"))
        limits = self.range(table.get("range"), unit)
        reader = TableReader(self.problems)
        reader.declared = self.declared
        made = reader.lookup_table(body, f"{key}.table.points", limits)
        return Parameter(entry.key, kind, unit, None, None, limits, key, entry.span, table=made)

    def _fitting(self, table: Table, unit: Unit, limits: Range | None) -> Fitting:
        node = table.get("neutral")
        neutral: Fraction | Literal["absent"] | None = None
        if isinstance(node, Scalar) and node.text == "absent":
            neutral = "absent"
        elif node is not None:
            neutral, _ = self.quantity(node, "neutral", node.span, unit)
            if limits and not limits[0] <= neutral <= limits[1]:
                self.problems.error("range", node.span, "the neutral value is outside the range")
        starts = []
        for item in self.items(table.get("starts"), "starts"):
            start, _ = self.quantity(item, "starts", item.span, unit)
            if limits and not limits[0] <= start <= limits[1]:
                self.problems.error("range", item.span, "this start is outside the range")
            starts.append(start)
        per = self.choice(table.get("per"), "per", ("model", "recording"), "model")
        form = self.choice(table.get("form"), "form", FORMS, "constant")
        return Fitting(neutral, tuple(starts), cast(Per, per), cast(Form, form))

    def _input(self, entry: Entry) -> Input:
        keys = ("unit", "range", "default", "type", "values")
        table = self.table(entry.node, f"inputs.{entry.key}", keys)
        kind, values = self.typing(table, entry.key)
        unit = self.unit(table.get("unit"))
        default: Fraction | None = None
        node = table.get("default")
        if node is not None:
            what = f"inputs.{entry.key}.default"
            default = self.value(node, what, node.span, unit, kind, values)
        limits = self.range(table.get("range"), unit)
        if kind == "int":
            limits = self.whole_range(limits, table.get("range"))
        key = f"inputs.{entry.key}"
        return Input(entry.key, unit, kind, default, limits, key, entry.span, values)

    def _discrete(self, tree: Table) -> dict[str, State]:
        found = {}
        for entry in self.named(tree.get("discrete"), "discrete"):
            key = f"discrete.{entry.key}"
            table = self.table(entry.node, key, ("type", "values", "unit", "initial", "range"))
            kind, values = self.typing(table, entry.key)
            unit = self.unit(table.get("unit"))
            initial = self.expression(table.get("initial"), f"{key}.initial", entry.span)
            limits = self.range(table.get("range"), unit)
            if kind == "int":
                limits = self.whole_range(limits, table.get("range"))
            if initial:
                found[entry.key] = State(
                    entry.key, unit, initial, limits, key, entry.span, kind, values
                )
        return found

    def _states(self, tree: Table) -> dict[str, State]:
        found = {}
        for entry in self.named(tree.get("states"), "states"):
            table = self.table(entry.node, f"states.{entry.key}", ("unit", "initial", "range"))
            known = self.model.states.get(entry.key) if self.model else None
            unit = (
                known.unit
                if known and "unit" not in table.entries
                else self.unit(table.get("unit"))
            )
            key = f"states.{entry.key}"
            initial = self.expression(table.get("initial"), f"{key}.initial", entry.span)
            limits = self.range(table.get("range"), unit)
            start = initial or Formula(Broken(entry.span), f"{key}.initial")
            found[entry.key] = State(entry.key, unit, start, limits, key, entry.span)
        return found
