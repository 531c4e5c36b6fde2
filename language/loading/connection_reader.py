"""Connection reader: the sensors, connections and outputs of a system."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from fractions import Fraction

from language.checks.declared_names import declaration_type
from language.expressions.syntax_tree import (
    BoolLiteral,
    ErrorNode,
    FunctionCall,
    Name,
    NumberLiteral,
    SyntaxTree,
    children,
    names,
    walk,
)
from language.expressions.units import PURE_NUMBER, SECOND, Dimension, Unit, are_compatible
from language.model.declaration import Formula
from language.model.system import Connection, DelayedSignal, Instance, Sensor, SystemInput
from language.readers.base_reader import Reader
from language.readers.difference_literal import read_difference
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import ExprType, IntType

SENSOR_KEYS = ("of", "filter", "delay", "noise", "quantise", "sample")


class ConnectionReader(Reader):
    """Reads the signals of a system and the expressions that read them.

    Sensors have to be read before connections, and connections before outputs. `delayed_signals`
    are those that connections created, and `dimensions` those of outputs that are real expressions.
    """

    def __init__(
        self,
        problems: Problems,
        inputs: Mapping[str, SystemInput],
        instances: Mapping[str, Instance],
    ) -> None:
        """Collect the types of the inputs of the system and of the outputs of its instances."""
        super().__init__(problems)
        self.inputs = inputs
        self.instances = instances
        self.sensors: dict[str, Sensor] = {}
        self.delayed_signals: dict[str, DelayedSignal] = {}
        self.dimensions: dict[str, Dimension] = {}
        self.signal_types: dict[str, ExprType] = {
            n: declaration_type(thing) for n, thing in inputs.items()
        }
        self.instance_outputs: dict[str, ExprType] = {}
        for instance in instances.values():
            self.instance_outputs.update(output_types(instance))
        self.signal_types.update(self.instance_outputs)
        self.measurable_types = {
            n: k for n, k in self.signal_types.items() if isinstance(k, Dimension)
        }

    def read_sensors(self, node: YamlNode | None) -> None:
        """Read `sensors` into `self.sensors`; connections and outputs can read them afterwards.

        A sensor with the name of an input or an instance is reported and left out. Other problems
        (a source that is no real input or output, a filter of an input, `delay` or `noise` without
        `sample`, times and levels that are not positive) are reported, and the sensor is kept.
        """
        for entry in self.named_entries(node, "sensors"):
            if entry.key in self.inputs or entry.key in self.instances:
                label = f"`{entry.key}` is an input or an instance of the system, too"
                self.problems.error("duplicate", entry.span, label)
                continue
            with self.problems.collect_errors():
                sensor = self._read_sensor(entry)
                self.sensors[entry.key] = sensor
                self.signal_types[entry.key] = sensor.dimension

    def _read_sensor(self, entry: Entry) -> Sensor:
        """Return one sensor; a wrong source and inconsistent stages are reported."""
        table = self.read_mapping(entry.node, f"sensors.{entry.key}", SENSOR_KEYS)
        source = self.read_scalar(table.get("of"), "of", entry.span)
        dimension = self.measurable_types.get(source.text, PURE_NUMBER) if source else PURE_NUMBER
        if source and source.text not in self.measurable_types:
            label = f"`{source.text}` is not an input or an output of an instance with a real value"
            self.problems.error(
                "name", source.span, label, suggest_name(source.text, self.measurable_types)
            )
        unit = Unit(str(dimension), Fraction(1), dimension)
        lag = self._read_stage(table, "filter", "lag", None)
        noise = self._read_stage(table, "noise", "sd", unit)
        period, offset = self._read_sample(table.get("sample"), entry.span)
        delay = self._read_time(table.get("delay"), "delay")
        sensor = Sensor(
            name=entry.key,
            source=source.text if source else "",
            dimension=dimension,
            lag=lag,
            delay=delay,
            noise=noise,
            quantum=self._read_positive(table.get("quantise"), "quantise", unit),
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

    def _read_stage(self, table: MappingNode, stage: str, key: str, unit: Unit | None) -> Fraction:
        """Return the value of a stage written `{key: value}`, 0 if the stage is absent.

        It is a time [s] if `unit` is None, else a positive difference in SI.
        """
        node = table.get(stage)
        if node is None:
            return Fraction(0)
        inner = self.read_mapping(node, stage, (key,)).get(key)
        if inner is None:
            self.problems.error("missing", node.span, f"`{stage}` has a `{key}`")
            return Fraction(0)
        if unit is None:
            return self._read_time(inner, f"{stage}.{key}")
        return self._read_positive(inner, f"{stage}.{key}", unit)

    def _read_sample(self, node: YamlNode | None, span: Span) -> tuple[Fraction | None, Fraction]:
        """Return the period and the offset [s] of `sample`; the period is None without one."""
        if node is None:
            return None, Fraction(0)
        if isinstance(node, ScalarNode):
            return self._read_time(node, "sample"), Fraction(0)
        table = self.read_mapping(node, "sample", ("period", "offset"))
        if "period" not in table.entries:
            self.problems.error("missing", span, "`sample` has a `period`")
            return None, Fraction(0)
        offset = table.get("offset")
        zero = isinstance(offset, ScalarNode) and offset.text.partition(" ")[0] == "0"
        later = Fraction(0) if zero else self._read_time(offset, "offset")
        return self._read_time(table.get("period"), "period"), later

    def _read_time(self, node: YamlNode | None, what: str) -> Fraction:
        """Return a positive time [s], 0 for an absent node.

        Another value is reported and gives 1 ms.
        """
        if node is None:
            return Fraction(0)
        value, unit = self.read_quantity(node, what, node.span, None)
        if value <= 0 or not are_compatible(unit.dimension, SECOND):
            label = f"`{what}` is a time above zero, like `5 ms`"
            self.problems.error("range", node.span, label)
            return Fraction(1, 1000)
        return value

    def _read_positive(self, node: YamlNode | None, what: str, unit: Unit) -> Fraction:
        """Return a positive difference in SI, 0 for an absent node; other values are reported."""
        if node is None:
            return Fraction(0)
        value = read_difference(self, node, what, node.span, unit)
        if value <= 0:
            self.problems.error("range", node.span, f"`{what}` is above zero")
        return value

    def read_connections(self, node: YamlNode | None) -> dict[tuple[str, str], Connection]:
        """Return the connections by instance and input; the keys of the node are `instance.input`.

        The source of a connection is a number in SI (a constant, also of a bool, int or enum), the
        name of a signal, or an expression. Calls `delay(signal, time)` in it become
        `delayed_signals`. A target that is no input of an instance and a source that is no scalar
        are reported and left out; unknown signals and wrong types are reported, and the connection
        is kept.
        """
        connections = {}
        for entry in self.read_mapping(node, "connections"):
            owner, _, name = entry.key.partition(".")
            target = self.instances.get(owner)
            if target is None or name not in target.automaton.inputs:
                known = [
                    f"{i.name}.{n}" for i in self.instances.values() for n in i.automaton.inputs
                ]
                label = f"`{entry.key}` is not an input of an instance"
                self.problems.error("name", entry.span, label, suggest_name(entry.key, known))
                continue
            source = self.read_scalar(entry.node, entry.key, entry.span)
            if source is None:
                continue
            with self.problems.collect_errors():
                connections[owner, name] = self._read_connection(target, name, source)
        return connections

    def _read_connection(self, target: Instance, name: str, source: ScalarNode) -> Connection:
        """Return the connection of an input: a constant, a signal or an expression."""
        declaration = target.automaton.inputs[name]
        to = (target.name, name)
        formula = self.read_expression(source, name, source.span)
        tree = formula.tree if formula else ErrorNode(source.span)
        if isinstance(tree, BoolLiteral) and declaration.is_bool:
            return Connection(to, Fraction(tree.value), source.span)
        if source.text in declaration.values or (not names(tree) and not declaration.is_bool):
            unit, values = declaration.unit, declaration.values
            value = self.read_typed_value(
                source, source.text, source.span, unit, declaration.type, values
            )
            return Connection(to, value, source.span)
        tree = self._replace_delays(tree)
        if isinstance(tree, Name):
            self._check_direct_connection(tree, declaration_type(declaration))
            return Connection(to, tree.path, source.span)
        check = TypeChecker(self._scope(), self.problems)
        check.check_assignment(tree, declaration_type(declaration), f"the input {name}")
        return Connection(to, Formula(tree, f"connections.{target.name}.{name}"), source.span)

    def _check_direct_connection(self, tree: Name, expected: ExprType) -> None:
        """Report a signal that does not exist or whose type does not fit the input."""
        kind = self.signal_types.get(tree.path)
        if kind is None:
            label = f"`{tree.path}` is not an input of the system or an output of an instance"
            self.problems.error(
                "name", tree.span, label, suggest_name(tree.path, self._connectable_names())
            )
        elif not _is_connectable(kind, expected):
            label = (
                f"`{tree.path}` is {_describe_kind(kind)}, the input is {_describe_kind(expected)}"
            )
            self.problems.error("dimension", tree.span, label)

    def _connectable_names(self) -> list[str]:
        """Return the names of all signals but the delayed ones, for hints."""
        return [name for name in self.signal_types if name not in self.delayed_signals]

    def _scope(self) -> NameEnvironment:
        """Return the name environment of expressions of the system."""
        return NameEnvironment(self.signal_types, location="in this system")

    def _replace_delays(self, tree: SyntaxTree) -> SyntaxTree:
        """Return an expression with each `delay(signal, d)` replaced by a name.

        The delayed signals of these names are added to `delayed_signals`.
        """
        if isinstance(tree, FunctionCall) and tree.function == "delay":
            return self._add_delay_line(tree)
        changed: dict[str, object] = {}
        for field in dataclasses.fields(tree):
            part = getattr(tree, field.name)
            if isinstance(part, tuple):
                changed[field.name] = tuple(self._replace_delays(item) for item in part)
            elif any(part is child for child in children(tree)):
                changed[field.name] = self._replace_delays(part)
        return dataclasses.replace(tree, **changed) if changed else tree  # type: ignore[arg-type]

    def _add_delay_line(self, tree: FunctionCall) -> SyntaxTree:
        """Add the delayed signal of a call of `delay` to `delayed_signals`, and return its name.

        A delay of 0 gives the signal itself. Wrong arguments are reported and give an ErrorNode.
        """
        match tree.arguments:
            case (Name(path, span), NumberLiteral(delay, unit, _)) if are_compatible(
                unit.dimension, SECOND
            ):
                if path not in self.signal_types or path in self.delayed_signals:
                    label = f"`{path}` is not an input of the system or an output of an instance"
                    self.problems.error(
                        "name", span, label, suggest_name(path, self._connectable_names())
                    )
                    return ErrorNode(span)
                if delay == 0:
                    return Name(path, tree.span)
                name = f"delay.{path}.{delay.numerator}.{delay.denominator}"
                self.delayed_signals[name] = DelayedSignal(name, path, delay)
                self.signal_types[name] = self.signal_types[path]
                return Name(name, tree.span)
        label = "a delay is `delay(signal, time)`, like `delay(T_req, 1 ms)`"
        self.problems.error("arguments", tree.span, label)
        return ErrorNode(tree.span)

    def read_outputs(self, node: YamlNode | None) -> dict[str, str | Formula]:
        """Return the outputs of the system by name: the name of a signal, or an expression.

        Signals are declared outputs of instances (`instance.output`), sensors and inputs of the
        system; others are reported and kept. Real expressions add to `dimensions`. Also reported:
        the name of an input or a sensor, and a call of `delay`. Sources that are no scalars are
        left out.
        """
        outputs: dict[str, str | Formula] = {}
        for entry in self.named_entries(node, "outputs"):
            source = self.read_scalar(entry.node, entry.key, entry.span)
            if source is None:
                continue
            if entry.key in self.inputs or entry.key in self.sensors:
                label = f"`{entry.key}` is an input or a sensor of the system, too"
                self.problems.error("duplicate", entry.span, label)
            if source.text.endswith(".mode") and source.text.split(".")[0] in self.instances:
                outputs[entry.key] = self._read_output(source)
                continue
            formula = self.read_expression(source, entry.key, entry.span)
            if formula is None:
                continue
            if isinstance(formula.tree, Name):
                outputs[entry.key] = self._read_output(source)
                continue
            self._check_no_delay(formula.tree)
            kind = TypeChecker(self._scope(), self.problems).infer_type(formula.tree)
            if isinstance(kind, Dimension):
                self.dimensions[entry.key] = kind
            outputs[entry.key] = Formula(formula.tree, f"outputs.{entry.key}")
        return outputs

    def _read_output(self, source: ScalarNode) -> str:
        """Return the name of a signal; one that does not exist is reported."""
        known = [
            f"{i.name}.{name}" for i in self.instances.values() for name in i.automaton.outputs
        ]
        if source.text not in (*known, *self.sensors, *self.inputs):
            label = f"`{source.text}` is not an output of an instance"
            self.problems.error("name", source.span, label, suggest_name(source.text, known))
        return source.text

    def _check_no_delay(self, tree: SyntaxTree) -> None:
        """Report calls of `delay` in an output."""
        for part in walk(tree):
            if isinstance(part, FunctionCall) and part.function == "delay":
                label = "an output of a system is not delayed"
                self.problems.error("form", part.span, label, "a sensor may have a `delay`")


def output_types(instance: Instance) -> dict[str, ExprType]:
    """Return the types of the outputs of an instance by `instance.output`.

    Outputs whose source has no type, such as `mode`, are left out.
    """
    automaton = instance.automaton
    return {
        f"{instance.name}.{name}": automaton.name_types[automaton.output_source(name)]
        for name in automaton.outputs
        if automaton.output_source(name) in automaton.name_types
    }


def _is_connectable(source: ExprType, target: ExprType) -> bool:
    """Tell whether an input of type `target` may read a signal of type `source`.

    Types have to be equal, and reals compatible in dimension; a real may read an integer.
    """
    if isinstance(target, Dimension):
        real = PURE_NUMBER if isinstance(source, IntType) else source
        return isinstance(real, Dimension) and are_compatible(real, target)
    if isinstance(target, IntType):
        return isinstance(source, IntType)
    return source == target


def _describe_kind(kind: ExprType) -> str:
    """Return a type as words for a message."""
    if kind == "truth":
        return "true or false"
    return f"in `{kind}`" if isinstance(kind, Dimension) else f"`{kind}`"
