"""Automaton reader: an expanded document as an unchecked Automaton.

It calls the readers of the sections. Problems of form are reported; language/checks examines the
result.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import cast

from language.expressions.name_rules import check_file_name
from language.expressions.units import SECOND, UNKNOWN_UNIT, are_compatible
from language.ir.number_type import NUMBER_TYPES, NumberType
from language.loading.instance_expansion import expand_instances
from language.lowering.event_queue import event_inputs
from language.model.automaton import Automaton
from language.model.chart_paths import fault_modes
from language.model.region_queries import attach_regions
from language.overlays.expand_document import Project, expand_document
from language.overlays.parameter_override import override_parameter
from language.readers.base_reader import Reader
from language.readers.chart_reader import CHART_KEYS, ChartReader, ModeStructure, is_chart
from language.readers.element_reader import ElementReader
from language.readers.mode_reader import ModeReader
from language.readers.observer_reader import METHODS
from language.readers.parameter_reader import ParameterReader
from language.readers.transition_table_reader import expand_transition_tables
from language.readers.truth_table_reader import TruthTableReader
from language.readers.variable_reader import VariableReader
from language.text.diagnostic import Problems, suggest_name
from language.text.document import Document, Entry, MappingNode, ScalarNode, YamlNode, require_kind
from language.text.overlay import apply_overlay, without_keys

COMMON_KEYS = ("language", "automaton", "parameters", "inputs", "states", "discrete", "equations")
LOGIC_KEYS = ("flow", "terms", "initial", "modes", "regions", "templates", "outputs")
DECISION_KEYS = ("tables", "transition_table", "instances")
EFFECT_SITE_KEYS = ("elements", "places")
RECORDING_KEYS = ("recording_map",)
FAULT_KEYS = ("faults", "fault_mode")
CLOCK_KEYS = ("period", "step", "method", "numbers", "model")
KEYS = (
    *(*COMMON_KEYS, *LOGIC_KEYS, *CHART_KEYS, *DECISION_KEYS, *EFFECT_SITE_KEYS),
    *(*CLOCK_KEYS, *FAULT_KEYS, *RECORDING_KEYS),
)
DEFAULT_STEP = Fraction(1, 1000)
"""Default major step [s] of a continuous automaton."""
MIN_TIME, MAX_TIME = Fraction(1, 10**9), Fraction(86400)
"""Bounds [s] of a period and of a step; a value outside suggests a wrong unit."""

ParameterValues = Mapping[str, YamlNode]
"""New values of parameters by name."""


def read_automaton(
    document: Document, project: Project, values: ParameterValues | None, problems: Problems
) -> Automaton:
    """Return the automaton of a document with some parameter values replaced.

    Overlays and instances are expanded first. `values` are new values by name, also of the model's
    parameters; unknown and derived ones are reported. The result has no types yet:
    `check_automaton` follows.

    Problems of form are reported and the reading continues with defaults (step DEFAULT_STEP, method
    `rk4`, numbers float64). Raises SpecError for another kind of document, an overlay or instance
    with an error, a model that has a model, and a region or chart without modes.
    """
    document = expand_document(document, project, problems)
    require_kind(document, "automaton", problems)
    problems.raise_if_errors()
    tree = expand_instances(document.root, project, problems)
    tree, model = _read_model(tree, project, values or {}, problems)
    _check_recording_map(tree, project, problems)
    return _AutomatonReader(document, tree, model, problems).read()


def _check_recording_map(tree: MappingNode, project: Project, problems: Problems) -> None:
    """Report a recording map whose file does not exist; its content is not read here."""
    node = tree.get("recording_map")
    if isinstance(node, ScalarNode):
        with problems.collect_errors():
            project.path_of(node.text, node.span)


def _read_model(
    tree: MappingNode, project: Project, values: ParameterValues, problems: Problems
) -> tuple[MappingNode, Automaton | None]:
    """Return the tree with its own values set, and the model, or None without a model.

    Parameters of the tree that the model has replace those of the model and are removed from the
    tree; values for them are passed to the model. A model with a model raises SpecError.
    """
    node = tree.get("model")
    own = _parameter_table(tree)
    if not isinstance(node, ScalarNode):
        return _set_values(tree, own, values, own, problems), None
    base = expand_document(project.read(project.path_of(node.text, node.span)), project, problems)
    if base.root.get("model") is not None:
        label = f"`{base.name}` has a `model` itself: a model is a continuous automaton"
        problems.error("model", node.span, label)
        problems.raise_if_errors()
    model_parameters = _parameter_table(base.root)
    shared = {key: entry for key, entry in own.entries.items() if key in model_parameters.entries}
    merged = apply_overlay(
        model_parameters, MappingNode(shared, own.span), problems, is_template=True
    )
    known = MappingNode({**model_parameters.entries, **own.entries}, own.span)
    model_values = {key: value for key, value in values.items() if key in model_parameters.entries}
    own_values = {key: value for key, value in values.items() if key not in model_values}
    root = _with_entry(base.root, "parameters", merged)
    changed = Document(base.kind, base.name, base.name_span, root, base.source)
    model = read_automaton(changed, project, model_values, problems)
    remaining = without_keys(own, *shared)
    return _set_values(
        _with_entry(tree, "parameters", remaining), remaining, own_values, known, problems
    ), model


def _parameter_table(tree: MappingNode) -> MappingNode:
    """Return the section `parameters` of a tree; an empty mapping without one."""
    node = tree.get("parameters")
    return node if isinstance(node, MappingNode) else MappingNode({}, tree.span)


def _with_entry(tree: MappingNode, key: str, node: YamlNode) -> MappingNode:
    """Return a mapping with another node under a key; an existing key keeps its place."""
    span = tree.entries[key].span if key in tree.entries else tree.span
    return MappingNode({**tree.entries, key: Entry(key, span, node)}, tree.span)


def _set_values(
    tree: MappingNode,
    parameters: MappingNode,
    values: ParameterValues,
    known: MappingNode,
    problems: Problems,
) -> MappingNode:
    """Return a tree with the values of its parameters replaced.

    Unknown and derived parameters are reported; `known` gives the names for hints.
    """
    for name, value in values.items():
        entry = parameters.entries.get(name)
        if entry is None or not isinstance(entry.node, MappingNode):
            label = f"there is no parameter `{name}`"
            problems.error("name", value.span, label, suggest_name(name, known.entries))
        elif "derived" in entry.node.entries:
            label = f"`{name}` is derived: its value follows from others"
            problems.error(
                "values",
                value.span,
                label,
                f"set the parameters that it reads; it is given at {entry.span}",
            )
        else:
            parameters = _with_entry(
                parameters, name, override_parameter(entry.node, value, problems)
            )
    return _with_entry(tree, "parameters", parameters) if values else tree


class _AutomatonReader(Reader):
    """Reads the sections of an automaton."""

    def __init__(
        self, document: Document, tree: MappingNode, model: Automaton | None, problems: Problems
    ) -> None:
        """Expand the transition tables of the tree and read the period."""
        super().__init__(problems)
        self.name, self.span = document.name, document.name_span
        self.model = model
        known = self.read_mapping(tree, f"automaton {document.name}", KEYS)
        self.tree = expand_transition_tables(known, problems)
        check_file_name(document.name, document.name_span, problems)
        self.period = self._read_time("period")
        self.is_sampled = self.period is not None

    def read(self) -> Automaton:
        """Return the automaton; problems are reported."""
        tree, model = self.tree, self.model
        numbers = self._read_number_type()
        own = ParameterReader(self.problems, tree).read_parameters()
        modes = self._read_modes()
        main, *parallel = modes.regions
        places = fault_modes(modes.statechart) if modes.statechart else main.modes
        element_reader = ElementReader(self.problems)
        variables = VariableReader(self.problems, model, self.is_sampled, tree, places)
        outputs = element_reader.read_outputs(tree.get("outputs"))
        events = event_inputs(modes.statechart, tree.get("events")) if modes.statechart else {}
        automaton = Automaton(
            name=self.name,
            period=self.period,
            step=self._read_time("step") or DEFAULT_STEP,
            method=self.read_choice(tree.get("method"), "method", METHODS, "rk4"),
            model=model,
            parameters={**(model.parameters if model else {}), **own},
            inputs={**variables.read_inputs(tree.get("inputs")), **events},
            states=variables.read_states(tree.get("states")),
            discrete=variables.read_discrete(tree.get("discrete")),
            modes=attach_regions(main.modes, tuple(parallel)),
            initial=main.initial,
            outputs=outputs.spans,
            span=self.span,
            output_sources=outputs.sources,
            elements=element_reader.read_elements(tree.get("elements")),
            places=element_reader.read_places(tree.get("places")),
            regions=tuple(parallel),
            numbers=numbers,
            faults=variables.faults,
            fault_mode=variables.fault_mode,
            recording_map=self._read_recording_map(),
            tables=TruthTableReader(self.problems).read_truth_tables(tree),
            superstates=modes.superstates,
            statechart=modes.statechart,
        )
        self._check_sections()
        return automaton

    def _read_modes(self) -> ModeStructure:
        """Return the regions of an automaton, and superstates and tree if it is a chart."""
        reader = ModeReader(self.problems, self.model, self.tree)
        if is_chart(self.tree):
            return ChartReader(reader).read(self.span)
        return ModeStructure(reader.read_regions(self.span))

    def _read_number_type(self) -> NumberType:
        """Return `numbers`, by default float64; a sampled automaton without it is reported."""
        node = self.tree.get("numbers")
        if node is None and self.is_sampled:
            self.read_scalar(node, "numbers", self.span)
        return cast(NumberType, self.read_choice(node, "numbers", NUMBER_TYPES, "float64"))

    def _read_recording_map(self) -> ScalarNode | None:
        """Return the name of the default recording map, or None."""
        node = self.tree.get("recording_map")
        return self.read_scalar(node, "recording_map", self.span) if node else None

    def _check_sections(self) -> None:
        """Report keys that only the other kind of automaton, sampled or continuous, has."""
        first = ("flow", "terms", "step", "method")
        for key in first if self.is_sampled else ("model", *FAULT_KEYS):
            node = self.tree.get(key)
            if node is not None:
                other = "continuous" if self.is_sampled else "sampled"
                label = f"`{key}` belongs to a {other} automaton"
                self.problems.error("form", self.tree.entries[key].span, label)

    def _read_time(self, what: str) -> Fraction | None:
        """Return the time [s] under a key, or None if it is absent.

        A value outside the bounds or in another dimension is reported and gives 1 ms.
        """
        node = self.tree.get(what)
        if node is None:
            return None
        value, unit = self.read_quantity(node, what, node.span, None)
        if not are_compatible(unit.dimension, SECOND):
            self.problems.error("dimension", node.span, f"`{what}` is a time, like `1 ms`")
        elif unit is not UNKNOWN_UNIT and not MIN_TIME <= value <= MAX_TIME:
            self.problems.error("range", node.span, f"`{what}` is a time from 1 ns to a day")
        elif unit is not UNKNOWN_UNIT:
            return value
        return Fraction(1, 1000)
