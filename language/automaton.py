"""Automaton reader: an expanded document to an Automaton, all problems of form reported."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import cast

from language.chart_reader import CHART_KEYS, ChartReader, ReadModes, is_chart
from language.chart_target import fault_modes
from language.document import Document, Entry, Node, Scalar, Table, require_kind
from language.element import ElementReader
from language.event import event_inputs
from language.instance import with_instances
from language.mode import ModeReader
from language.model import Automaton
from language.names import check_file_name
from language.number import NUMBERS, NumberType
from language.observer import METHODS
from language.overlay import lay, without
from language.parameter_reader import ParameterReader
from language.problem import Problems, nearest
from language.project import Project, expanded
from language.reader import Reader
from language.region import with_regions
from language.transition_table import with_transition_tables
from language.truth_table import TruthTableReader
from language.units import SECOND, UNKNOWN_UNIT, fits
from language.values import with_given
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
DEFAULT_STEP = Fraction(1, 1000)
"""Major step of a continuous automaton that gives none."""
SHORTEST, LONGEST = Fraction(1, 10**9), Fraction(86400)
"""Bounds [s] of a period and a step; beyond them is a mistake of the unit."""

Values = Mapping[str, Node]


def read_automaton(
    document: Document, project: Project, values: Values | None, problems: Problems
) -> Automaton:
    """Read an automaton or variant with some parameter values replaced.

    Problems of form are reported and reading goes on; SpecError where there is nothing to read.
    """
    document = expanded(document, project, problems)
    require_kind(document, "automaton", problems)
    problems.stop_if_any()
    tree = with_instances(document.root, project, problems)
    tree, model = _with_model(tree, project, values or {}, problems)
    _find_recording_map(tree, project, problems)
    return _AutomatonReader(document, tree, model, problems).read()


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
            parameters = _with(parameters, name, with_given(entry.node, value, problems))
    return _with(tree, "parameters", parameters) if values else tree


class _AutomatonReader(Reader):
    """The sections of an automaton, one method each."""

    def __init__(
        self, document: Document, tree: Table, model: Automaton | None, problems: Problems
    ) -> None:
        super().__init__(problems)
        self.name, self.at = document.name, document.name_span
        self.model = model
        known = self.table(tree, f"automaton {document.name}", KEYS)
        self.tree = with_transition_tables(known, problems)
        check_file_name(document.name, document.name_span, problems)
        self.period = self._time("period")
        self.sampled = self.period is not None

    def read(self) -> Automaton:
        tree, model = self.tree, self.model
        numbers = self._numbers()
        own = ParameterReader(self.problems, tree).parameters()
        modes = self._modes()
        main, *beside = modes.regions
        places = fault_modes(modes.tree) if modes.tree else main.modes
        laid_on = ElementReader(self.problems)
        variables = VariableReader(self.problems, model, self.sampled, tree, places)
        outputs = laid_on.outputs(tree.get("outputs"))
        events = event_inputs(modes.tree, tree.get("events")) if modes.tree else {}
        automaton = Automaton(
            name=self.name,
            period=self.period,
            step=self._time("step") or DEFAULT_STEP,
            method=self.choice(tree.get("method"), "method", METHODS, "rk4"),
            model=model,
            parameters={**(model.parameters if model else {}), **own},
            inputs={**variables.inputs(tree.get("inputs")), **events},
            states=variables.states(tree.get("states")),
            discrete=variables.discrete(tree.get("discrete")),
            modes=with_regions(main.modes, tuple(beside)),
            initial=main.initial,
            outputs=outputs.spans,
            span=self.at,
            sources=outputs.sources,
            elements=laid_on.elements(tree.get("elements")),
            places=laid_on.places(tree.get("places")),
            regions=tuple(beside),
            numbers=numbers,
            faults=variables.faults,
            fault_mode=variables.fault_mode,
            recording_map=self._recording_map(),
            tables=TruthTableReader(self.problems).tables(tree),
            superstates=modes.superstates,
            tree=modes.tree,
        )
        self._check_sections()
        return automaton

    def _modes(self) -> ReadModes:
        """Return the modes: of a chart with their tree, else as they stand."""
        reader = ModeReader(self.problems, self.model, self.tree)
        if is_chart(self.tree):
            return ChartReader(reader).read(self.at)
        return ReadModes(reader.regions(self.at))

    def _numbers(self) -> NumberType:
        """A sampled automaton says what it computes in; a continuous one has float64 by default."""
        node = self.tree.get("numbers")
        if node is None and self.sampled:
            self.scalar(node, "numbers", self.at)
        return cast(NumberType, self.choice(node, "numbers", NUMBERS, "float64"))

    def _recording_map(self) -> Scalar | None:
        """The map by which recordings are read where no other is given."""
        node = self.tree.get("recording_map")
        return self.scalar(node, "recording_map", self.at) if node else None

    def _check_sections(self) -> None:
        first = ("flow", "terms", "step", "method")
        for key in first if self.sampled else ("model", *FAULT_KEYS):
            node = self.tree.get(key)
            if node is not None:
                other = "continuous" if self.sampled else "sampled"
                label = f"`{key}` belongs to a {other} automaton"
                self.problems.error("form", self.tree.entries[key].span, label)

    def _time(self, what: str) -> Fraction | None:
        node = self.tree.get(what)
        if node is None:
            return None
        value, unit = self.quantity(node, what, node.span, None)
        if not fits(unit.dimension, SECOND):
            self.problems.error("dimension", node.span, f"`{what}` is a time, like `1 ms`")
        elif unit is not UNKNOWN_UNIT and not SHORTEST <= value <= LONGEST:
            self.problems.error("range", node.span, f"`{what}` is a time from 1 ns to a day")
        elif unit is not UNKNOWN_UNIT:
            return value
        return Fraction(1, 1000)
