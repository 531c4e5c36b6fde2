"""Variable reader: inputs, states and discrete variables with their types, ranges and faults."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fractions import Fraction
from typing import Literal, cast

from language.declaration import Formula, Input, Limits, Range, State
from language.document import Entry, Node, Scalar, Table
from language.kind import Type
from language.limit import OWN_FAULTS
from language.model import Automaton
from language.problem import Problems, nearest
from language.reader import Reader, about_of
from language.syntax import Broken
from language.units import Unit

LIMIT_KEYS = ("on_range", "fallback", "fault")
ON_RANGE = ("saturate", "hold", "fault")
OnRange = Literal["saturate", "hold", "fault"]


class VariableReader(Reader):
    """The sections of an automaton that declare what changes; `model` knows units of states."""

    def __init__(
        self,
        problems: Problems,
        model: Automaton | None,
        sampled: bool,
        tree: Table,
        modes: Collection[str],
    ) -> None:
        """Read `faults` and `fault_mode`, which the ranges name."""
        super().__init__(problems)
        self.model = model
        self.sampled = sampled
        self.faults = self._faults(tree)
        self.fault_mode: str | None = None
        node = tree.get("fault_mode")
        if node is not None:
            self.fault_mode = self.text(node, "fault_mode", node.span).removeprefix("chart.")
            if isinstance(node, Scalar) and self.fault_mode not in modes:
                label = f"there is no mode `{self.fault_mode}` of the chart"
                self.problems.error("name", node.span, label, nearest(self.fault_mode, modes))

    def inputs(self, node: Node | None) -> dict[str, Input]:
        """Return the inputs by name."""
        return {entry.key: self._input(entry) for entry in self.named(node, "inputs")}

    def _input(self, entry: Entry) -> Input:
        keys = ("unit", "range", "default", "type", "values", *LIMIT_KEYS)
        key = f"inputs.{entry.key}"
        table = self.table(entry.node, key, keys)
        kind, values = self.typing(table, entry.key)
        unit = self.unit(table.get("unit"))
        default = self.default(table, key, unit, kind, values)
        limits = self.range(table.get("range"), unit)
        if kind == "int":
            limits = self.whole_range(limits, table.get("range"))
        span = entry.span
        outside = self.limits(table, unit, kind, values, limits)
        about = about_of(table)
        return Input(entry.key, unit, kind, default, limits, key, span, values, outside, about)

    def states(self, node: Node | None) -> dict[str, State]:
        """Return the states by name."""
        found = {}
        for entry in self.named(node, "states"):
            keys = ("unit", "initial", "range", *LIMIT_KEYS)
            table = self.table(entry.node, f"states.{entry.key}", keys)
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
            outside = self.limits(table, unit, "real", (), limits)
            found[entry.key] = State(
                entry.key,
                unit,
                start,
                limits,
                key,
                entry.span,
                limits=outside,
                about=about_of(table),
            )
        return found

    def discrete(self, node: Node | None) -> dict[str, State]:
        """Return the discrete variables by name."""
        found = {}
        for entry in self.named(node, "discrete"):
            key = f"discrete.{entry.key}"
            keys = ("type", "values", "unit", "initial", "range", *LIMIT_KEYS)
            table = self.table(entry.node, key, keys)
            kind, values = self.typing(table, entry.key)
            unit = self.unit(table.get("unit"))
            initial = self.expression(table.get("initial"), f"{key}.initial", entry.span)
            limits = self.range(table.get("range"), unit)
            if kind == "int":
                limits = self.whole_range(limits, table.get("range"))
            if initial:
                found[entry.key] = State(
                    entry.key,
                    unit,
                    initial,
                    limits,
                    key,
                    entry.span,
                    kind,
                    values,
                    self.limits(table, unit, kind, values, limits),
                    about_of(table),
                )
        return found

    def limits(
        self, table: Table, unit: Unit, kind: Type, values: Sequence[str], limits: Range | None
    ) -> Limits:
        """What becomes of a value outside its range (rule 18)."""
        for key in LIMIT_KEYS:
            place = table.entries.get(key)
            if place and not self.sampled:
                label = f"`{key}` belongs to a sampled automaton: a continuous one is never clamped"
                self.problems.error("form", place.span, label)
            elif place and limits is None and kind != "enum":
                self.problems.error("missing", place.span, f"`{key}` needs a `range` beside it")
        node = table.get("fallback")
        fallback: Fraction | Literal["hold"] | None = None
        if isinstance(node, Scalar) and node.text == "hold":
            fallback = "hold"
        elif node is not None:
            fallback = self.value(node, "fallback", node.span, unit, kind, values)
            if limits and not limits[0] <= fallback <= limits[1]:
                self.problems.error("range", node.span, "the fallback is outside the range")
        on_range = self.choice(table.get("on_range"), "on_range", ON_RANGE, "saturate")
        fault_node = table.get("fault")
        fault = self.text(fault_node, "fault", fault_node.span) if fault_node else None
        if fault_node and fault is not None and fault not in self.faults:
            label = f"there is no fault `{fault}` in `faults`"
            self.problems.error("name", fault_node.span, label, nearest(fault, self.faults))
        if on_range == "fault" and self.fault_mode is None:
            place = table.entries["on_range"]
            self.problems.error("missing", place.span, "`on_range: fault` needs a `fault_mode`")
        return Limits(cast(OnRange, on_range), fallback, fault)

    def _faults(self, tree: Table) -> dict[str, bool]:
        found = {}
        for entry in self.named(tree.get("faults"), "faults"):
            table = self.table(entry.node, f"faults.{entry.key}", ("latched",))
            latched = self.choice(table.get("latched"), "latched", ("true", "false"), "true")
            found[entry.key] = latched == "true"
            if entry.key in OWN_FAULTS:
                label = f"`{entry.key}` is a fault that modewright sets"
                self.problems.error("name", entry.span, label)
        return found
