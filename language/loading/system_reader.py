"""System reader: instances of automata, their connections, and the order in which they run."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

from language.expressions.units import SECOND, are_compatible
from language.ir.number_type import NumberType
from language.loading.connection_reader import ConnectionReader
from language.loading.load import automaton_of
from language.model.automaton import Automaton
from language.model.graph_algorithms import find_cycle, format_cycle, topological_sort
from language.model.system import Connection, Instance, System, SystemInput
from language.overlays.expand_document import Project, expand_document
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, Span, SpecError, suggest_name
from language.text.document import Document, Entry, MappingNode, ScalarNode, YamlNode, require_kind
from language.text.node_edit import format_inline

SYSTEM_KEYS = tuple(
    "language system inputs instances sensors connections outputs".split()  # noqa: SIM905
)
SYSTEM_INPUT_KEYS = ("unit", "default", "type", "values")
INSTANCE_KEYS = ("of", "values", "offset")

Connections = Mapping[tuple[str, str], Connection]
"""Connections by instance and input."""
ExecutionOrder = tuple[str, ...]
"""Names of instances and sensors in the order in which they run at one instant."""
Overrides = Mapping[str, ScalarNode]
"""Parameter values from the command line, by `parameter` or `instance.parameter`."""


def read_system(document: Document, project: Project, overrides: Overrides | None = None) -> System:
    """Return the system of a document with all its automata checked.

    An automaton gives a system of one instance (see `single_instance_system`). `overrides` are
    parameter values by `parameter` (all instances that have it) or `instance.parameter`, which has
    precedence; both come before the values of the file. Raises SpecError with all problems, among
    them overrides without a parameter, inputs that are not connected and cycles of direct
    feed-through (rule 19a).
    """
    plain, document = document, expand_document(document, project)
    problems = Problems()
    if document.kind == "automaton":
        return single_instance_system(automaton_of(plain, project, overrides))
    require_kind(document, "system", problems)
    problems.raise_if_errors()
    system = _SystemReader(problems, project, dict(overrides or {})).read(document)
    problems.raise_if_errors()
    return system


def with_number_type(system: System, numbers: NumberType) -> System:
    """Return the system with another number type in every instance.

    Models of the automata keep theirs. Nothing is checked again.
    """
    instances = {
        name: dataclasses.replace(
            instance, automaton=dataclasses.replace(instance.automaton, numbers=numbers)
        )
        for name, instance in system.instances.items()
    }
    return dataclasses.replace(system, instances=instances)


def single_instance_system(automaton: Automaton) -> System:
    """Return a system of one instance that has the name and the inputs of an automaton.

    Each input of the system is connected to the input of its name; ranges of inputs are not kept.
    The system has no outputs and no sensors, the instance the offset 0, and `sole_instance` its
    name.
    """
    name, at = automaton.name, automaton.span
    return System(
        name=name,
        inputs={
            declaration.name: SystemInput(
                declaration.name,
                declaration.unit,
                declaration.default,
                declaration.span,
                declaration.type,
                declaration.values,
            )
            for declaration in automaton.inputs.values()
        },
        instances={name: Instance(name, automaton, Fraction(0), name, at)},
        connections={(name, key): Connection((name, key), key, at) for key in automaton.inputs},
        outputs={},
        order=(name,),
        span=at,
        sole_instance=name,
    )


class _SystemReader(Reader):
    """Reads the sections of a system."""

    def __init__(
        self, problems: Problems, project: Project, overrides: dict[str, ScalarNode]
    ) -> None:
        """Report into `problems`; `overrides` are the parameter values from the command line."""
        super().__init__(problems)
        self.project = project
        self.overrides = overrides
        self.used_overrides: set[str] = set()
        self.documents: dict[Path, Document] = {}
        self.automaton_cache: dict[tuple[object, ...], Automaton] = {}

    def read(self, document: Document) -> System:
        """Return the system. Raises SpecError."""
        tree = self.read_mapping(document.root, f"system {document.name}", SYSTEM_KEYS)
        inputs = {
            e.key: self._read_input(e) for e in self.named_entries(tree.get("inputs"), "inputs")
        }
        instances = {}
        for entry in self.named_entries(tree.get("instances"), "instances"):
            with self.problems.collect_errors():
                instances[entry.key] = self._read_instance(entry)
        if not self.problems.has_errors:
            self._report_unused_overrides(instances)
        self.problems.raise_if_errors()
        wires = ConnectionReader(self.problems, inputs, instances)
        wires.read_sensors(tree.get("sensors"))
        connections = wires.read_connections(tree.get("connections"))
        self._report_unconnected_inputs(connections, instances)
        outputs = wires.read_outputs(tree.get("outputs"))
        self.problems.raise_if_errors()
        order = self._execution_order(wires, connections, document.name_span)
        return System(
            name=document.name,
            inputs=inputs,
            instances=instances,
            connections=connections,
            outputs=outputs,
            order=order,
            span=document.name_span,
            sensors=wires.sensors,
            delayed_signals=wires.delayed_signals,
            dimensions=wires.dimensions,
        )

    def _read_input(self, entry: Entry) -> SystemInput:
        """Return one input of the system."""
        table = self.read_mapping(entry.node, f"inputs.{entry.key}", SYSTEM_INPUT_KEYS)
        kind, values = self.read_type(table, entry.key)
        unit = self.read_unit(table.get("unit"))
        default = self.read_default(table, f"inputs.{entry.key}", unit, kind, values)
        return SystemInput(entry.key, unit, default, entry.span, kind, values)

    def _read_instance(self, entry: Entry) -> Instance:
        """Return one instance; values of the command line take precedence. Raises SpecError."""
        key = f"instances.{entry.key}"
        table = self.read_mapping(entry.node, key, INSTANCE_KEYS)
        of = self.read_scalar(table.get("of"), "of", entry.span)
        values: dict[str, YamlNode] = {}
        for value in self.read_mapping(table.get("values"), f"{key}.values"):
            is_table = isinstance(value.node, MappingNode)
            if is_table or self.read_scalar(value.node, f"values.{value.key}", value.span):
                values[value.key] = value.node
        offset, unit = Fraction(0), None
        node = table.get("offset")
        if node is not None:
            offset, unit = self.read_quantity(node, "offset", node.span, None)
            if offset < 0 or (offset and not are_compatible(unit.dimension, SECOND)):
                self.problems.error("range", node.span, "`offset` is a time of at least 0 s")
        if of is None:
            raise SpecError(())
        automaton = self._read_automaton(of, values)
        overrides = self._overrides_of(entry.key, automaton)
        if overrides:
            automaton = self._read_automaton(of, {**values, **overrides})
        return Instance(entry.key, automaton, offset, key, entry.span)

    def _read_automaton(self, reference: ScalarNode, values: Mapping[str, YamlNode]) -> Automaton:
        """Return a checked automaton.

        Instances with the same reference and the same values share one object.
        """
        cache_key = (
            reference.text,
            *((name, format_inline(value)) for name, value in values.items()),
        )
        if cache_key not in self.automaton_cache:
            path = self.project.path_of(reference.text, reference.span)
            if path not in self.documents:
                self.documents[path] = self.project.read(path)
            automaton = automaton_of(self.documents[path], self.project, values)
            self.automaton_cache[cache_key] = automaton
        return self.automaton_cache[cache_key]

    def _overrides_of(self, instance: str, automaton: Automaton) -> dict[str, ScalarNode]:
        """Return the command-line values for an instance by parameter, and mark them as used.

        A value with the name of the instance takes precedence over one without.
        """
        overrides = {}
        for name, value in sorted(self.overrides.items(), key=lambda item: "." in item[0]):
            owner, _, parameter = name.rpartition(".")
            if owner == instance or (not owner and parameter in automaton.parameters):
                overrides[parameter] = value
                self.used_overrides.add(name)
        return overrides

    def _report_unused_overrides(self, instances: Mapping[str, Instance]) -> None:
        """Report command-line values whose parameter no instance has."""
        known = {
            name
            for instance in instances.values()
            for p in instance.automaton.parameters
            for name in (p, f"{instance.name}.{p}")
        }
        for name, value in self.overrides.items():
            if name not in self.used_overrides:
                label = f"no instance has a parameter `{name}`"
                self.problems.error("name", value.span, label, suggest_name(name, known))

    def _report_unconnected_inputs(
        self,
        connections: Mapping[tuple[str, str], Connection],
        instances: Mapping[str, Instance],
    ) -> None:
        """Report inputs of instances without a connection and without a default."""
        for instance in instances.values():
            for name, declaration in instance.automaton.inputs.items():
                if (instance.name, name) not in connections and declaration.default is None:
                    label = f"input `{instance.name}.{name}` is not connected"
                    hint = "connect it, or give it a `default` in the automaton"
                    self.problems.error("missing", instance.span, label, hint)

    def _execution_order(
        self, wires: ConnectionReader, connections: Connections, span: Span
    ) -> ExecutionOrder:
        """Return instances and sensors in topological order of direct feed-through (rule 19a).

        A cycle is reported; the instances are then in the order of the file.
        """
        instances = wires.instances
        edges: dict[str, list[str]] = {name: [] for name in (*instances, *wires.sensors)}
        for sensor in wires.sensors.values():
            owner = sensor.source.partition(".")[0]
            if not sensor.delay and owner in instances:
                edges[owner].append(sensor.name)
        pairs: set[frozenset[str]] = set()
        for connection in connections.values():
            target = instances[connection.target[0]]
            if not target.automaton.is_sampled:
                self._check_continuous_target(wires, connection, target, pairs)
            for read in connection.reads:
                owner = read.partition(".")[0] if read not in wires.delayed_signals else ""
                if owner in edges and target.automaton.is_sampled:
                    edges[owner].append(target.name)
        order = topological_sort(edges)
        if order is None:
            label = (
                f"instances read each other at the same instant: {format_cycle(find_cycle(edges))}"
            )
            hint = "a delay breaks the cycle: `delay(signal, 1 ms)`, or a sensor with `delay`"
            self.problems.error("loop", span, label, hint)
        return tuple(order or instances)

    def _check_continuous_target(
        self,
        wires: ConnectionReader,
        connection: Connection,
        target: Instance,
        pairs: set[frozenset[str]],
    ) -> None:
        """Report what a connection to a continuous automaton reads although it cannot.

        These are sensors without `sample` and outputs of a continuous automaton. A pair of
        automata is reported once, for all its connections in both directions; `pairs` has the pairs
        that were reported and is changed. An own output of the target is reported if the connection
        reads no other continuous automaton.
        """
        owners: dict[str, str] = {}
        for read in connection.reads:
            sensor = wires.sensors.get(read)
            if sensor and sensor.period is None:
                label = f"`{target.name}` is continuous and reads sensor `{read}`, "
                label += "which has no `sample`"
                self.problems.error("connection", connection.span, label, "like `sample: 1 ms`")
            source = wires.delayed_signals[read].source if read in wires.delayed_signals else read
            owner = wires.instances.get(source.partition(".")[0])
            if owner and "." in source and not owner.automaton.is_sampled:
                owners.setdefault(owner.name, source)
        for name, source in owners.items():
            pair = frozenset((name, target.name))
            if pair in pairs or (name == target.name and len(owners) > 1):
                continue
            pairs.add(pair)
            label = f"`{name}` and `{target.name}` are both continuous"
            hint = "this version connects a continuous automaton to sampled ones only"
            if name == target.name:
                label = f"`{name}` is continuous and reads its own output `{source}`"
                hint = f"write the term in the automaton of `{name}`"
            self.problems.error("connection", connection.span, label, hint)
