"""Connection reader: sensors, connections and outputs of a system, as expressions of signals."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from fractions import Fraction

from language.declaration import Formula
from language.declared import declared_kind
from language.difference import difference
from language.dimension import DimensionCheck
from language.document import Entry, Node, Scalar, Table
from language.experiment import Connection, Instance, SystemInput
from language.kind import Kind, Whole
from language.problem import Problems, Span, nearest
from language.reader import Reader
from language.scope import Scope
from language.signal import Line, Sensor
from language.syntax import Application, Broken, Name, Number, Tree, Truth, children, names, walk
from language.units import NUMBER, SECOND, Dimension, Unit, fits

SENSOR_KEYS = ("of", "filter", "delay", "noise", "quantise", "sample")


class ConnectionReader(Reader):
    """What is known on the wires of a system, and what reads it."""

    def __init__(
        self,
        problems: Problems,
        inputs: Mapping[str, SystemInput],
        instances: Mapping[str, Instance],
    ) -> None:
        """Read against the inputs and instances of the system."""
        super().__init__(problems)
        self.inputs = inputs
        self.instances = instances
        self.sensors: dict[str, Sensor] = {}
        self.lines: dict[str, Line] = {}
        self.dimensions: dict[str, Dimension] = {}
        self.known: dict[str, Kind] = {n: declared_kind(thing) for n, thing in inputs.items()}
        self.parts: dict[str, Kind] = {}
        for instance in instances.values():
            self.parts.update(output_kinds(instance))
        self.known.update(self.parts)
        self.measurable = {n: k for n, k in self.known.items() if isinstance(k, Dimension)}

    # Sensors.

    def read_sensors(self, node: Node | None) -> None:
        """Read `sensors`; they are known to connections and outputs from then on."""
        for entry in self.named(node, "sensors"):
            if entry.key in self.inputs or entry.key in self.instances:
                label = f"`{entry.key}` is an input or an instance of the system, too"
                self.problems.error("duplicate", entry.span, label)
                continue
            with self.problems.collecting():
                sensor = self._sensor(entry)
                self.sensors[entry.key] = sensor
                self.known[entry.key] = sensor.dimension

    def _sensor(self, entry: Entry) -> Sensor:
        table = self.table(entry.node, f"sensors.{entry.key}", SENSOR_KEYS)
        source = self.scalar(table.get("of"), "of", entry.span)
        dimension = self.measurable.get(source.text, NUMBER) if source else NUMBER
        if source and source.text not in self.measurable:
            label = f"`{source.text}` is not an input or an output of an instance with a real value"
            self.problems.error("name", source.span, label, nearest(source.text, self.measurable))
        unit = Unit(str(dimension), Fraction(1), dimension)
        lag = self._part(table, "filter", "lag", None)
        noise = self._part(table, "noise", "sd", unit)
        period, offset = self._sample(table.get("sample"), entry.span)
        delay = self._time(table.get("delay"), "delay")
        sensor = Sensor(
            name=entry.key,
            source=source.text if source else "",
            dimension=dimension,
            lag=lag,
            delay=delay,
            noise=noise,
            quantum=self._positive(table.get("quantise"), "quantise", unit),
            period=period,
            offset=offset,
            span=entry.span,
        )
        if lag and source and source.text in self.inputs:
            label = "a sensor of an input of the system has no `filter`"
            hint = "filter it in an automaton: `update: {y: previous(y) + ...}`"
            self.problems.error("connection", table.entries["filter"].span, label, hint)
        for stage in ("delay", "noise"):
            if period is None and stage in table.entries:
                label = f"a sensor with `{stage}` has a `sample`"
                hint = "like `sample: 1 ms`, the period at which it measures"
                self.problems.error("missing", table.entries[stage].span, label, hint)
        return sensor

    def _part(self, table: Table, stage: str, key: str, unit: Unit | None) -> Fraction:
        node = table.get(stage)
        if node is None:
            return Fraction(0)
        inner = self.table(node, stage, (key,)).get(key)
        if inner is None:
            self.problems.error("missing", node.span, f"`{stage}` has a `{key}`")
            return Fraction(0)
        if unit is None:
            return self._time(inner, f"{stage}.{key}")
        return self._positive(inner, f"{stage}.{key}", unit)

    def _sample(self, node: Node | None, span: Span) -> tuple[Fraction | None, Fraction]:
        if node is None:
            return None, Fraction(0)
        if isinstance(node, Scalar):
            return self._time(node, "sample"), Fraction(0)
        table = self.table(node, "sample", ("period", "offset"))
        if "period" not in table.entries:
            self.problems.error("missing", span, "`sample` has a `period`")
            return None, Fraction(0)
        offset = table.get("offset")
        zero = isinstance(offset, Scalar) and offset.text.partition(" ")[0] == "0"
        later = Fraction(0) if zero else self._time(offset, "offset")
        return self._time(table.get("period"), "period"), later

    def _time(self, node: Node | None, what: str) -> Fraction:
        if node is None:
            return Fraction(0)
        value, unit = self.quantity(node, what, node.span, None)
        if value <= 0 or not fits(unit.dimension, SECOND):
            label = f"`{what}` is a time above zero, like `5 ms`"
            self.problems.error("range", node.span, label)
            return Fraction(1, 1000)
        return value

    def _positive(self, node: Node | None, what: str, unit: Unit) -> Fraction:
        if node is None:
            return Fraction(0)
        value = difference(self, node, what, node.span, unit)
        if value <= 0:
            self.problems.error("range", node.span, f"`{what}` is above zero")
        return value

    # Connections.

    def connections(self, node: Node | None) -> dict[tuple[str, str], Connection]:
        """Return what each input of an instance reads."""
        found = {}
        for entry in self.table(node, "connections"):
            owner, _, name = entry.key.partition(".")
            target = self.instances.get(owner)
            if target is None or name not in target.automaton.inputs:
                known = [
                    f"{i.name}.{n}" for i in self.instances.values() for n in i.automaton.inputs
                ]
                label = f"`{entry.key}` is not an input of an instance"
                self.problems.error("name", entry.span, label, nearest(entry.key, known))
                continue
            source = self.scalar(entry.node, entry.key, entry.span)
            if source is None:
                continue
            with self.problems.collecting():
                found[owner, name] = self._connection(target, name, source)
        return found

    def _connection(self, target: Instance, name: str, source: Scalar) -> Connection:
        wanted = target.automaton.inputs[name]
        to = (target.name, name)
        formula = self.expression(source, name, source.span)
        tree = formula.tree if formula else Broken(source.span)
        if isinstance(tree, Truth) and wanted.truth:
            return Connection(to, Fraction(tree.value), source.span)
        if source.text in wanted.values or (not names(tree) and not wanted.truth):
            unit, values = wanted.unit, wanted.values
            value = self.value(source, source.text, source.span, unit, wanted.type, values)
            return Connection(to, value, source.span)
        tree = self._without_delays(tree)
        if isinstance(tree, Name):
            self._plain(tree, declared_kind(wanted))
            return Connection(to, tree.path, source.span)
        check = DimensionCheck(self._scope(), self.problems)
        check.assigned(tree, declared_kind(wanted), f"the input {name}")
        return Connection(to, Formula(tree, f"connections.{target.name}.{name}"), source.span)

    def _plain(self, tree: Name, wanted: Kind) -> None:
        kind = self.known.get(tree.path)
        if kind is None:
            label = f"`{tree.path}` is not an input of the system or an output of an instance"
            self.problems.error("name", tree.span, label, nearest(tree.path, self._visible()))
        elif not _joins(kind, wanted):
            label = f"`{tree.path}` is {_said(kind)}, the input is {_said(wanted)}"
            self.problems.error("dimension", tree.span, label)

    def _visible(self) -> list[str]:
        return [name for name in self.known if name not in self.lines]

    def _scope(self) -> Scope:
        return Scope(self.known, place="in this system")

    def _without_delays(self, tree: Tree) -> Tree:
        """Replace every `delay(signal, d)` by the name of a line."""
        if isinstance(tree, Application) and tree.function == "delay":
            return self._line(tree)
        changed: dict[str, object] = {}
        for field in dataclasses.fields(tree):
            part = getattr(tree, field.name)
            if isinstance(part, tuple):
                changed[field.name] = tuple(self._without_delays(item) for item in part)
            elif any(part is child for child in children(tree)):
                changed[field.name] = self._without_delays(part)
        return dataclasses.replace(tree, **changed) if changed else tree  # type: ignore[arg-type]

    def _line(self, tree: Application) -> Tree:
        match tree.arguments:
            case (Name(path, span), Number(delay, unit, _)) if fits(unit.dimension, SECOND):
                if path not in self.known or path in self.lines:
                    label = f"`{path}` is not an input of the system or an output of an instance"
                    self.problems.error("name", span, label, nearest(path, self._visible()))
                    return Broken(span)
                if delay == 0:
                    return Name(path, tree.span)
                name = f"delay.{path}.{delay.numerator}.{delay.denominator}"
                self.lines[name] = Line(name, path, delay)
                self.known[name] = self.known[path]
                return Name(name, tree.span)
        label = "a delay is `delay(signal, time)`, like `delay(T_req, 1 ms)`"
        self.problems.error("arguments", tree.span, label)
        return Broken(tree.span)

    # Outputs.

    def outputs(self, node: Node | None) -> dict[str, str | Formula]:
        """Return the outputs of the system: a signal by name, or an expression."""
        found: dict[str, str | Formula] = {}
        for entry in self.named(node, "outputs"):
            source = self.scalar(entry.node, entry.key, entry.span)
            if source is None:
                continue
            if entry.key in self.inputs or entry.key in self.sensors:
                label = f"`{entry.key}` is an input or a sensor of the system, too"
                self.problems.error("duplicate", entry.span, label)
            if source.text.endswith(".mode") and source.text.split(".")[0] in self.instances:
                found[entry.key] = self._output(source)
                continue
            formula = self.expression(source, entry.key, entry.span)
            if formula is None:
                continue
            if isinstance(formula.tree, Name):
                found[entry.key] = self._output(source)
                continue
            self._no_delay(formula.tree)
            kind = DimensionCheck(self._scope(), self.problems).kind(formula.tree)
            if isinstance(kind, Dimension):
                self.dimensions[entry.key] = kind
            found[entry.key] = Formula(formula.tree, f"outputs.{entry.key}")
        return found

    def _output(self, source: Scalar) -> str:
        known = [
            f"{i.name}.{name}" for i in self.instances.values() for name in i.automaton.outputs
        ]
        if source.text not in (*known, *self.sensors, *self.inputs):
            label = f"`{source.text}` is not an output of an instance"
            self.problems.error("name", source.span, label, nearest(source.text, known))
        return source.text

    def _no_delay(self, tree: Tree) -> None:
        for part in walk(tree):
            if isinstance(part, Application) and part.function == "delay":
                label = "an output of a system is not delayed"
                self.problems.error("form", part.span, label, "a sensor may have a `delay`")


def output_kinds(instance: Instance) -> dict[str, Kind]:
    """Return what the outputs of an instance are; its mode, a number, is not among them."""
    automaton = instance.automaton
    return {
        f"{instance.name}.{name}": automaton.kinds[automaton.source_of(name)]
        for name in automaton.outputs
        if automaton.source_of(name) in automaton.kinds
    }


def _joins(source: Kind, target: Kind) -> bool:
    """A connection joins equal kinds; a whole number may be read as a real number."""
    if isinstance(target, Dimension):
        real = NUMBER if isinstance(source, Whole) else source
        return isinstance(real, Dimension) and fits(real, target)
    if isinstance(target, Whole):
        return isinstance(source, Whole)
    return source == target


def _said(kind: Kind) -> str:
    if kind == "truth":
        return "true or false"
    return f"in `{kind}`" if isinstance(kind, Dimension) else f"`{kind}`"
