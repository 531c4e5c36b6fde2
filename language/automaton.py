"""Automaton reader: an expanded document to an Automaton, all problems of form reported."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Literal, cast

from language.chart_reader import CHART_KEYS, ChartReader, is_chart
from language.chart_target import mode_paths
from language.declaration import Fitting, Formula, Kind, Parameter, Range
from language.document import Document, Entry, Node, Scalar, Table
from language.element import ElementReader
from language.event import event_inputs
from language.instance import with_instances
from language.mode import ModeReader
from language.model import Automaton
from language.names import check_file_name
from language.number import NUMBERS, NumberType
from language.observer import METHODS
from language.overlay import lay, without
from language.problem import Problems, nearest
from language.project import Project, expanded
from language.reader import Reader, about_of
from language.region import with_regions
from language.table import TableReader, section
from language.transition_table import with_transition_tables
from language.truth_table import TruthTableReader
from language.units import NO_UNIT, SECOND, Unit, fits, parse_unit
from language.values import with_value
from language.variable import VariableReader

COMMON_KEYS = ("language", "automaton", "parameters", "inputs", "states", "discrete", "equations")
LOGIC_KEYS = ("flow", "terms", "initial", "modes", "regions", "templates", "outputs")
DECISION_KEYS = ("tables", "transition_table", "instances")
LAID_KEYS = ("elements", "places")
RECORDING_KEYS = ("recording_map",)
FAULT_KEYS = ("faults", "fault_mode")
CLOCK_KEYS = ("period", "step", "method", "numbers", "model")
KEYS = (
    *(*COMMON_KEYS, *LOGIC_KEYS, *CHART_KEYS, *DECISION_KEYS, *LAID_KEYS),
    *(*CLOCK_KEYS, *FAULT_KEYS, *RECORDING_KEYS),
)
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
    tree = with_instances(document.root, project, problems)
    tree, model = _with_model(tree, project, values or {}, problems)
    _find_recording_map(tree, project, problems)
    return _AutomatonReader(problems).read(document, tree, model)


def _find_recording_map(tree: Table, project: Project, problems: Problems) -> None:
    """Report a map of recordings that is not there; it is read when a recording is."""
    node = tree.get("recording_map")
    if isinstance(node, Scalar):
        with problems.collecting():
            project.path_of(node.text, node.span)


def _with_model(
    tree: Table, project: Project, values: Values, problems: Problems
) -> tuple[Table, Automaton | None]:
    """Apply values; parameters that the model has go to the model, the rest stays."""
    node = tree.get("model")
    own = _parameters(tree)
    if not isinstance(node, Scalar):
        return _set_values(tree, own, values, own, problems), None
    base = expanded(project.read(project.path_of(node.text, node.span)), project, problems)
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
        tree = self.table(tree, f"automaton {document.name}", KEYS)
        tree = with_transition_tables(tree, self.problems)
        self.at = document.name_span
        check_file_name(document.name, document.name_span, self.problems)
        self.model = model
        self.declared = (section(tree, "inputs"), section(tree, "states"))
        period = self._time(tree.get("period"), "period")
        self.sampled = period is not None
        numbers = self._numbers(tree)
        own = {e.key: self._parameter(e) for e in self.named(tree.get("parameters"), "parameters")}
        modes = ModeReader(self.problems, model, tree)
        read = ChartReader(modes).read(self.at) if is_chart(tree) else None
        chart, *beside = read.regions if read else modes.regions(self.at)
        places = mode_paths(read.tree) if read else chart.modes
        laid_on = ElementReader(self.problems)
        variables = VariableReader(self.problems, model, self.sampled, tree, places)
        outputs = laid_on.outputs(tree.get("outputs"))
        events = event_inputs(read.tree, tree.get("events")) if read else {}
        automaton = Automaton(
            name=document.name,
            period=period,
            step=self._time(tree.get("step"), "step") or DEFAULT_STEP,
            method=self.choice(tree.get("method"), "method", METHODS, "rk4"),
            model=model,
            parameters={**(model.parameters if model else {}), **own},
            inputs={**variables.inputs(tree.get("inputs")), **events},
            states=variables.states(tree.get("states")),
            discrete=variables.discrete(tree.get("discrete")),
            modes=with_regions(chart.modes, tuple(beside)),
            initial=chart.initial,
            outputs=outputs.spans,
            span=document.name_span,
            sources=outputs.sources,
            elements=laid_on.elements(tree.get("elements")),
            places=laid_on.places(tree.get("places")),
            regions=tuple(beside),
            numbers=numbers,
            faults=variables.faults,
            fault_mode=variables.fault_mode,
            recording_map=self._recording_map(tree.get("recording_map")),
            tables=TruthTableReader(self.problems).tables(tree),
            superstates=read.superstates if read else (),
            tree=read.tree if read else None,
        )
        self._check_sections(tree)
        return automaton

    def _numbers(self, tree: Table) -> NumberType:
        """A sampled automaton says what it computes in; a continuous one has float64 by default."""
        node = tree.get("numbers")
        if node is None and self.sampled:
            self.scalar(node, "numbers", self.at)
        return cast(NumberType, self.choice(node, "numbers", NUMBERS, "float64"))

    def _recording_map(self, node: Node | None) -> Scalar | None:
        """The map by which recordings are read where no other is given."""
        return self.scalar(node, "recording_map", self.at) if node else None

    def _check_sections(self, tree: Table) -> None:
        first = ("flow", "terms", "step", "method")
        for key in first if self.sampled else ("model", *FAULT_KEYS):
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
            derived = self._derived(table, key, entry)
        elif type_ != "real":
            node, what = table.get("value"), f"{key}.value"
            value = self.value(node, what, entry.span, NO_UNIT, type_, values)
        else:
            value, own = self.quantity(table.get("value"), f"{key}.value", entry.span, unit)
            unit = unit or own
        unit = unit or parse_unit("1")
        limits = self.range(table.get("range"), unit)
        if limits and value is not None and not limits[0] <= value <= limits[1]:
            span = cast(Scalar, table.get("value")).span
            self.problems.error("range", span, f"the value of `{entry.key}` is outside its range")
        if type_ == "int":
            limits = self.whole_range(limits, table.get("range"))
        fitting = self._fitting(table, unit, limits)
        place = (entry.key, kind, unit, value, derived, limits, key, entry.span)
        return Parameter(*place, fitting, type_, values, about=about_of(table))

    def _derived(self, table: Table, key: str, entry: Entry) -> Formula | None:
        for other in ("value", "tunable", "range", "type"):
            if other in table.entries:
                label = f"a derived parameter has no `{other}`"
                self.problems.error("form", table.entries[other].span, label)
        return self.expression(table.get("derived"), f"{key}.derived", entry.span)

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
        return Parameter(
            entry.key,
            kind,
            unit,
            None,
            None,
            limits,
            key,
            entry.span,
            table=made,
            about=about_of(body),
        )

    def _fitting(self, table: Table, unit: Unit, limits: Range | None) -> Fitting:
        node = table.get("neutral")
        neutral: Fraction | Literal["absent"] | None = None
        if isinstance(node, Scalar) and node.text == "absent":
            neutral = "absent"
        elif node is not None:
            neutral, _ = self.quantity(node, "neutral", node.span, unit)
            if limits and not limits[0] <= neutral <= limits[1]:
                self.problems.error("range", node.span, "the neutral value is outside the range")
        items = self.items(table.get("starts"), "starts")
        starts = [self.quantity(item, "starts", item.span, unit)[0] for item in items]
        for item, start in zip(items, starts, strict=True):
            if limits and not limits[0] <= start <= limits[1]:
                self.problems.error("range", item.span, "this start is outside the range")
        per = self.choice(table.get("per"), "per", ("model", "recording"), "model")
        form = self.choice(table.get("form"), "form", FORMS, "constant")
        return Fitting(neutral, tuple(starts), cast(Per, per), cast(Form, form))
