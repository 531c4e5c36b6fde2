"""System reader: instances of automata, connected, in the order in which they run."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from language.document import Document, Entry, Scalar, Table
from language.graph import chain, circle, topological
from language.load import automaton_of
from language.model import Automaton, Connection, Instance, System, SystemInput
from language.problem import Problems, Span, nearest
from language.project import Project, expanded, read_document
from language.reader import Reader
from language.units import SECOND, Dimension, fits

SYSTEM_KEYS = ("language", "system", "inputs", "instances", "connections", "outputs")
INSTANCE_KEYS = ("of", "values", "offset")

Overrides = Mapping[str, Scalar]
"""Parameter values from the command line, by `parameter` or `instance.parameter`."""


def read_system(document: Document, project: Project, overrides: Overrides | None = None) -> System:
    """Read a system with all its automata, checked. Raises SpecError with all problems."""
    document = expanded(document, project)
    problems = Problems()
    if document.kind != "system":
        label = f"`{document.name}` is a {document.kind}, not a system"
        problems.error("form", document.name_span, label)
    problems.stop_if_any()
    system = _SystemReader(problems, project, dict(overrides or {})).read(document)
    problems.stop_if_any()
    return system


class _SystemReader(Reader):
    """The sections of a system, one method each."""

    def __init__(self, problems: Problems, project: Project, overrides: dict[str, Scalar]) -> None:
        super().__init__(problems)
        self.project = project
        self.overrides = overrides
        self.used: set[str] = set()

    def read(self, document: Document) -> System:
        tree = self.table(document.root, f"system {document.name}", SYSTEM_KEYS)
        inputs = {e.key: self._input(e) for e in self.named(tree.get("inputs"), "inputs")}
        instances = {}
        for entry in self.named(tree.get("instances"), "instances"):
            with self.problems.collecting():
                instances[entry.key] = self._instance(entry)
        if not self.problems.has_errors:
            self._unused_overrides(instances)
        self.problems.stop_if_any()
        connections = self._connections(tree, inputs, instances)
        self._unconnected(connections, instances)
        outputs = self._outputs(tree, instances)
        order = self._order(connections, instances, document.name_span)
        return System(
            document.name, inputs, instances, connections, outputs, order, document.name_span
        )

    def _input(self, entry: Entry) -> SystemInput:
        table = self.table(entry.node, f"inputs.{entry.key}", ("unit", "default", "range"))
        unit = self.unit(table.get("unit"))
        default: Fraction | None = None
        node = table.get("default")
        if node is not None:
            default, _ = self.quantity(node, f"inputs.{entry.key}.default", node.span, unit)
        return SystemInput(entry.key, unit, default, entry.span)

    def _instance(self, entry: Entry) -> Instance:
        key = f"instances.{entry.key}"
        table = self.table(entry.node, key, INSTANCE_KEYS)
        of = self.scalar(table.get("of"), "of", entry.span)
        values: dict[str, Scalar] = {}
        for value in self.table(table.get("values"), f"{key}.values"):
            scalar = self.scalar(value.node, f"values.{value.key}", value.span)
            if scalar:
                values[value.key] = scalar
        offset, unit = Fraction(0), None
        node = table.get("offset")
        if node is not None:
            offset, unit = self.quantity(node, "offset", node.span, None)
            if offset < 0 or (offset and not fits(unit.dimension, SECOND)):
                self.problems.error("range", node.span, "`offset` is a time of at least 0 s")
        self.problems.stop_if_any()
        assert of is not None
        document = read_document(self.project.path_of(of.text, of.span))
        plain = automaton_of(document, self.project, values)
        mine = self._overrides_of(entry.key, plain)
        automaton = plain
        if mine:
            automaton = automaton_of(document, self.project, {**values, **mine})
        return Instance(entry.key, automaton, offset, key, entry.span)

    def _overrides_of(self, instance: str, automaton: Automaton) -> dict[str, Scalar]:
        found = {}
        for name, value in sorted(self.overrides.items(), key=lambda item: "." in item[0]):
            owner, _, parameter = name.rpartition(".")
            if owner == instance or (not owner and parameter in automaton.parameters):
                found[parameter] = value
                self.used.add(name)
        return found

    def _unused_overrides(self, instances: Mapping[str, Instance]) -> None:
        known = {
            name
            for instance in instances.values()
            for p in instance.automaton.parameters
            for name in (p, f"{instance.name}.{p}")
        }
        for name, value in self.overrides.items():
            if name not in self.used:
                label = f"no instance has a parameter `{name}`"
                self.problems.error("name", value.span, label, nearest(name, known))

    def _connections(
        self,
        tree: Table,
        inputs: Mapping[str, SystemInput],
        instances: Mapping[str, Instance],
    ) -> dict[tuple[str, str], Connection]:
        found = {}
        for entry in self.table(tree.get("connections"), "connections"):
            owner, _, name = entry.key.partition(".")
            target = instances.get(owner)
            if target is None or name not in target.automaton.inputs:
                known = [f"{i.name}.{n}" for i in instances.values() for n in i.automaton.inputs]
                label = f"`{entry.key}` is not an input of an instance"
                self.problems.error("name", entry.span, label, nearest(entry.key, known))
                continue
            source = self.scalar(entry.node, entry.key, entry.span)
            if source is None:
                continue
            with self.problems.collecting():
                made = self._connection(target, name, source, inputs, instances)
                found[owner, name] = made
        return found

    def _connection(
        self,
        target: Instance,
        name: str,
        source: Scalar,
        inputs: Mapping[str, SystemInput],
        instances: Mapping[str, Instance],
    ) -> Connection:
        wanted = target.automaton.inputs[name]
        known: dict[str, Dimension] = {n: thing.unit.dimension for n, thing in inputs.items()}
        for instance in instances.values():
            known.update(_output_dimensions(instance))
        text = source.text
        if text in known:
            if not fits(known[text], wanted.unit.dimension) or wanted.truth:
                want = "true or false" if wanted.truth else f"in `{wanted.unit.dimension}`"
                label = f"`{text}` is in `{known[text]}`, the input is {want}"
                self.problems.error("dimension", source.span, label)
            return Connection((target.name, name), text, source.span)
        if text[:1].isalpha():
            label = f"`{text}` is not an input of the system or an output of an instance"
            self.problems.error("name", source.span, label, nearest(text, known))
            return Connection((target.name, name), Fraction(0), source.span)
        value, _ = self.quantity(source, text, source.span, wanted.unit)
        return Connection((target.name, name), value, source.span)

    def _unconnected(
        self,
        connections: Mapping[tuple[str, str], Connection],
        instances: Mapping[str, Instance],
    ) -> None:
        for instance in instances.values():
            for name, thing in instance.automaton.inputs.items():
                if (instance.name, name) not in connections and thing.default is None:
                    label = f"input `{instance.name}.{name}` is not connected"
                    hint = "connect it, or give it a `default` in the automaton"
                    self.problems.error("missing", instance.span, label, hint)

    def _outputs(self, tree: Table, instances: Mapping[str, Instance]) -> dict[str, str]:
        found = {}
        known = [
            f"{instance.name}.{name}"
            for instance in instances.values()
            for name in instance.automaton.outputs
        ]
        for entry in self.named(tree.get("outputs"), "outputs"):
            source = self.scalar(entry.node, entry.key, entry.span)
            if source and source.text not in known:
                label = f"`{source.text}` is not an output of an instance"
                self.problems.error("name", source.span, label, nearest(source.text, known))
            elif source:
                found[entry.key] = source.text
        return found

    def _order(
        self,
        connections: Mapping[tuple[str, str], Connection],
        instances: Mapping[str, Instance],
        span: Span,
    ) -> tuple[str, ...]:
        """Instances at one instant run in the order of direct feed-through (rule 19)."""
        edges: dict[str, list[str]] = {name: [] for name in instances}
        for connection in connections.values():
            if isinstance(connection.source, str) and "." in connection.source:
                owner, target = connection.source.partition(".")[0], connection.target[0]
                self._both_continuous(instances[owner], instances[target], connection)
                if instances[target].automaton.is_sampled:
                    edges[owner].append(target)
        found = topological(edges)
        if found is None:
            label = f"instances read each other at the same instant: {chain(circle(edges))}"
            hint = "an output that reads no input of its tick breaks the circle: a state"
            self.problems.error("loop", span, label, hint)
        return tuple(found or instances)

    def _both_continuous(self, owner: Instance, target: Instance, at: Connection) -> None:
        if not owner.automaton.is_sampled and not target.automaton.is_sampled:
            label = f"`{owner.name}` and `{target.name}` are both continuous"
            hint = "this version connects a continuous automaton to sampled ones only"
            self.problems.error("connection", at.span, label, hint)


def _output_dimensions(instance: Instance) -> dict[str, Dimension]:
    automaton = instance.automaton
    return {
        f"{instance.name}.{name}": automaton.dimensions[automaton.source_of(name)]
        for name in automaton.outputs
        if automaton.source_of(name) in automaton.dimensions
    }
