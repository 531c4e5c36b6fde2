"""Parameter reader: parameters with values, expressions or tables, and their settings for fits."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, cast

from language.expressions.units import NO_UNIT, UNKNOWN_UNIT, Unit, parse_unit
from language.model.declaration import Fitting, Formula, Parameter, ParameterKind, Range
from language.readers.base_reader import Reader
from language.readers.lookup_table_reader import LookupTableReader, section_of
from language.text.diagnostic import Problems
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode

FITTING_KEYS = ("neutral", "plain", "starts", "per", "form", "scale")
FIT_FORMS = ("constant", "constant_or_random_walk", "order")
FitScope = Literal["model", "recording"]
FitForm = Literal["constant", "constant_or_random_walk", "order"]


class ParameterReader(Reader):
    """Reads the section `parameters` of an automaton with the tree `root`."""

    def __init__(self, problems: Problems, root: MappingNode) -> None:
        """Report into `problems`; `root` is the tree of the automaton.

        Its sections `inputs` and `states` give the units of the axes of lookup tables.
        """
        super().__init__(problems)
        self.root = root
        self.axis_sections = (section_of(root, "inputs"), section_of(root, "states"))

    def read_parameters(self) -> dict[str, Parameter]:
        """Return all parameters by name in the order of the file; problems are reported.

        The kind is "derived" with the key `derived`, else "tunable" or "fixed" (default). The unit
        is `unit`, else that of the value, else 1. The value is in SI, for other types as by
        `read_typed_value`; None for a derived parameter or a lookup table. A missing value gives 0.
        Values outside the range are reported and kept.
        """
        entries = self.named_entries(self.root.get("parameters"), "parameters")
        return {entry.key: self._read_parameter(entry) for entry in entries}

    def _read_parameter(self, entry: Entry) -> Parameter:
        """Return one parameter; a value outside its range is reported.

        The unit is `unit`, else that of the value, else 1.
        """
        own_keys = ("value", "unit", "range", "tunable", "derived", "type", "values", "table")
        keys = (*own_keys, *FITTING_KEYS)
        table = self.read_mapping(entry.node, f"parameters.{entry.key}", keys)
        if "table" in table.entries:
            return self._read_table_parameter(entry, table)
        type_, values = self.read_type(table, entry.key)
        key = f"parameters.{entry.key}"
        unit_node = table.get("unit")
        unit: Unit | None = self.read_unit(unit_node) if unit_node else None
        tunable = (
            self.read_choice(table.get("tunable"), "tunable", ("true", "false"), "false") == "true"
        )
        kind: ParameterKind = "tunable" if tunable else "fixed"
        value, derived = None, None
        if "derived" in table.entries:
            kind = "derived"
            derived = self._read_derived(table, key, entry)
        elif type_ != "real":
            node, what = table.get("value"), f"{key}.value"
            value = self.read_typed_value(node, what, entry.span, NO_UNIT, type_, values)
        else:
            value, own = self.read_quantity(table.get("value"), f"{key}.value", entry.span, unit)
            unit = unit or own
        unit = unit or parse_unit("1")
        limits = self.read_range(table.get("range"), unit)
        if unit is UNKNOWN_UNIT:
            limits = None  # reported as an unknown unit
        value_node = table.get("value")
        if value is not None and value_node:
            self.check_value_in_range(entry.key, value, limits, unit, value_node.span)
        if type_ == "int":
            limits = self.check_integer_range(limits, table.get("range"))
        if "scale" in table.entries:
            label = "only a parameter of an effect has a scale"
            self.problems.error("form", table.entries["scale"].span, label)
        fitting = self._read_fitting(table, unit, limits)
        common = (entry.key, kind, unit, value, derived, limits, key, entry.span)
        return Parameter(*common, fitting, type_, values, about=table.text_of("about"))

    def _read_derived(self, table: MappingNode, key: str, entry: Entry) -> Formula | None:
        """Return the expression of a derived parameter, or None if it is missing.

        Keys that exclude `derived` are reported.
        """
        for other in ("value", "tunable", "range", "type"):
            if other in table.entries:
                label = f"a derived parameter has no `{other}`"
                self.problems.error("form", table.entries[other].span, label)
        return self.read_expression(table.get("derived"), f"{key}.derived", entry.span)

    def _read_table_parameter(self, entry: Entry, table: MappingNode) -> Parameter:
        """Return a parameter with a lookup table; keys that exclude it are reported."""
        key = f"parameters.{entry.key}"
        for other in ("value", "derived", "unit", "type", "values", *FITTING_KEYS):
            if other in table.entries:
                label = f"a table has no `{other}` beside it"
                self.problems.error("form", table.entries[other].span, label)
        tunable = self.read_choice(table.get("tunable"), "tunable", ("true", "false"), "false")
        kind: ParameterKind = "tunable" if tunable == "true" else "fixed"
        body = self.read_mapping(table.get("table"), f"{key}.table", ("over", "unit", "points"))
        unit = self.read_unit(body.get("unit"))
        limits = self.read_range(table.get("range"), unit)
        reader = LookupTableReader(self.problems)
        reader.axis_sections = self.axis_sections
        lookup_table = reader.read_lookup_table(body, f"{key}.table.points", limits)
        return Parameter(
            entry.key,
            kind,
            unit,
            None,
            None,
            limits,
            key,
            entry.span,
            table=lookup_table,
            about=body.text_of("about"),
        )

    def _read_fitting(self, table: MappingNode, unit: Unit, value_range: Range | None) -> Fitting:
        """Return the settings of a parameter for a fit; values outside its range are reported."""
        node, plain = table.get("neutral"), table.get("plain")
        neutral: Fraction | Literal["absent"] | None = None
        if isinstance(node, ScalarNode) and node.text == "absent":
            neutral = "absent"
        elif node is not None:
            neutral = self._read_within_range(
                node, "neutral", "the neutral value", unit, value_range
            )
        plainer = None
        if plain is not None:
            plainer = self._read_within_range(plain, "plain", "the plain value", unit, value_range)
        items = self.read_list(table.get("starts"), "starts")
        starts = [
            self._read_within_range(item, "starts", "this start", unit, value_range)
            for item in items
        ]
        per = self.read_choice(table.get("per"), "per", ("model", "recording"), "model")
        form = self.read_choice(table.get("form"), "form", FIT_FORMS, "constant")
        return Fitting(neutral, tuple(starts), cast(FitScope, per), cast(FitForm, form), plainer)

    def _read_within_range(
        self, node: YamlNode, key: str, description: str, unit: Unit, value_range: Range | None
    ) -> Fraction:
        """Return a literal in SI; one outside the range is reported as `description`."""
        value, _ = self.read_quantity(node, key, node.span, unit)
        if value_range and not value_range[0] <= value <= value_range[1]:
            self.problems.error("range", node.span, f"{description} is outside the range")
        return value
