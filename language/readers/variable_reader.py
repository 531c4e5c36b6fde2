"""Variable reader: inputs, states and discrete variables with types, ranges and faults."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fractions import Fraction
from typing import Literal, cast

from language.expressions.syntax_tree import ErrorNode
from language.expressions.units import Unit
from language.model.automaton import Automaton
from language.model.declaration import BUILTIN_FAULTS, Formula, Input, Range, RangePolicy, State
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.typecheck.types import TypeName

RANGE_POLICY_KEYS = ("on_range", "fallback", "fault")
RANGE_ACTIONS = ("saturate", "hold", "fault")
RangeAction = Literal["saturate", "hold", "fault"]


class VariableReader(Reader):
    """Reads the sections that declare variables.

    A state without a unit gets that of the state of the same name in `model`.
    """

    def __init__(
        self,
        problems: Problems,
        model: Automaton | None,
        is_sampled: bool,
        tree: MappingNode,
        modes: Collection[str],
    ) -> None:
        """Read `faults` and `fault_mode` of the tree of an automaton into attributes.

        `modes` are the names of the modes that a fault may enter; another name is reported and
        kept. `fault_mode` is stored without the prefix `chart.`, None if absent. `faults` tells by
        name whether a fault is latched (default true); names in BUILTIN_FAULTS are reported.
        """
        super().__init__(problems)
        self.model = model
        self.is_sampled = is_sampled
        self.faults = self._read_faults(tree)
        self.fault_mode: str | None = None
        node = tree.get("fault_mode")
        if node is not None:
            self.fault_mode = self.read_string(node, "fault_mode", node.span).removeprefix("chart.")
            if isinstance(node, ScalarNode) and self.fault_mode not in modes:
                label = f"there is no mode `{self.fault_mode}` of the chart"
                self.problems.error("name", node.span, label, suggest_name(self.fault_mode, modes))

    def read_inputs(self, node: YamlNode | None) -> dict[str, Input]:
        """Return the inputs by name in the order of the file; problems are reported, none left out.

        Default and range are in SI and None if absent; without a type and unit an input is a real
        in 1.
        """
        return {entry.key: self._read_input(entry) for entry in self.named_entries(node, "inputs")}

    def _read_input(self, entry: Entry) -> Input:
        """Return one input with its type, range and default (SI)."""
        keys = ("unit", "range", "default", "type", "values", *RANGE_POLICY_KEYS)
        key = f"inputs.{entry.key}"
        table = self.read_mapping(entry.node, key, keys)
        kind, values = self.read_type(table, entry.key)
        unit = self.read_unit(table.get("unit"))
        default = self.read_default(table, key, unit, kind, values)
        limits = self.read_range(table.get("range"), unit)
        if kind == "int":
            limits = self.check_integer_range(limits, table.get("range"))
        span = entry.span
        outside = self.read_range_policy(table, unit, kind, values, limits)
        about = table.text_of("about")
        return Input(entry.key, unit, kind, default, limits, key, span, values, outside, about)

    def read_states(self, node: YamlNode | None) -> dict[str, State]:
        """Return the states by name; one without a unit has that of the state in `model`, else 1.

        All are real. A missing `initial` is reported and gives an ErrorNode. The range is in SI,
        None if it is absent or wrong.
        """
        states = {}
        for entry in self.named_entries(node, "states"):
            keys = ("unit", "initial", "range", *RANGE_POLICY_KEYS)
            table = self.read_mapping(entry.node, f"states.{entry.key}", keys)
            known = self.model.states.get(entry.key) if self.model else None
            unit = (
                known.unit
                if known and "unit" not in table.entries
                else self.read_unit(table.get("unit"))
            )
            key = f"states.{entry.key}"
            initial = self.read_expression(table.get("initial"), f"{key}.initial", entry.span)
            limits = self.read_range(table.get("range"), unit)
            start = initial or Formula(ErrorNode(entry.span), f"{key}.initial")
            outside = self.read_range_policy(table, unit, "real", (), limits)
            states[entry.key] = State(
                entry.key,
                unit,
                start,
                limits,
                key,
                entry.span,
                range_policy=outside,
                about=table.text_of("about"),
            )
        return states

    def read_discrete(self, node: YamlNode | None) -> dict[str, State]:
        """Return the discrete variables by name; one without `initial` is reported and left out.

        Their type is real (default), int, bool or enum. The range is in SI, None if it is absent or
        wrong.
        """
        variables = {}
        for entry in self.named_entries(node, "discrete"):
            key = f"discrete.{entry.key}"
            keys = ("type", "values", "unit", "initial", "range", *RANGE_POLICY_KEYS)
            table = self.read_mapping(entry.node, key, keys)
            kind, values = self.read_type(table, entry.key)
            unit = self.read_unit(table.get("unit"))
            initial = self.read_expression(table.get("initial"), f"{key}.initial", entry.span)
            limits = self.read_range(table.get("range"), unit)
            if kind == "int":
                limits = self.check_integer_range(limits, table.get("range"))
            if initial:
                variables[entry.key] = State(
                    entry.key,
                    unit,
                    initial,
                    limits,
                    key,
                    entry.span,
                    kind,
                    values,
                    self.read_range_policy(table, unit, kind, values, limits),
                    table.text_of("about"),
                )
        return variables

    def read_range_policy(
        self,
        table: MappingNode,
        unit: Unit,
        type_name: TypeName,
        values: Sequence[str],
        value_range: Range | None,
    ) -> RangePolicy:
        """Return the reaction to a value outside its range (rule 18).

        Defaults: `on_range: saturate`, `fallback` None, `fault` None. `fallback` is a number like
        that of `read_typed_value`, or "hold". `value_range` is the range in SI. Reported, not
        raised: keys in a continuous automaton, keys without a range unless the type is enum, a
        fallback outside the range, an unknown fault, and `on_range: fault` without a fault mode.
        """
        for key in RANGE_POLICY_KEYS:
            place = table.entries.get(key)
            if place and not self.is_sampled:
                label = f"`{key}` belongs to a sampled automaton: a continuous one is never clamped"
                self.problems.error("form", place.span, label)
            elif place and value_range is None and type_name != "enum":
                self.problems.error("missing", place.span, f"`{key}` needs a `range` beside it")
        node = table.get("fallback")
        fallback: Fraction | Literal["hold"] | None = None
        if isinstance(node, ScalarNode) and node.text == "hold":
            fallback = "hold"
        elif node is not None:
            fallback = self.read_typed_value(node, "fallback", node.span, unit, type_name, values)
            if value_range and not value_range[0] <= fallback <= value_range[1]:
                self.problems.error("range", node.span, "the fallback is outside the range")
        on_range = self.read_choice(table.get("on_range"), "on_range", RANGE_ACTIONS, "saturate")
        fault_node = table.get("fault")
        fault = self.read_string(fault_node, "fault", fault_node.span) if fault_node else None
        if fault_node and fault is not None and fault not in self.faults:
            label = f"there is no fault `{fault}` in `faults`"
            self.problems.error("name", fault_node.span, label, suggest_name(fault, self.faults))
        if on_range == "fault" and self.fault_mode is None:
            place = table.entries["on_range"]
            self.problems.error("missing", place.span, "`on_range: fault` needs a `fault_mode`")
        return RangePolicy(cast(RangeAction, on_range), fallback, fault)

    def _read_faults(self, tree: MappingNode) -> dict[str, bool]:
        """Return the declared faults by name, and whether each one is latched."""
        faults = {}
        for entry in self.named_entries(tree.get("faults"), "faults"):
            table = self.read_mapping(entry.node, f"faults.{entry.key}", ("latched",))
            latched = self.read_choice(table.get("latched"), "latched", ("true", "false"), "true")
            faults[entry.key] = latched == "true"
            if entry.key in BUILTIN_FAULTS:
                label = f"`{entry.key}` is a fault that modewright sets"
                self.problems.error("name", entry.span, label)
        return faults
