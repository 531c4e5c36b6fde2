"""Parameter reader: parameters with values, formulas or tables, and how each is fitted."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, cast

from language.declaration import Fitting, Formula, Kind, Parameter, Range
from language.document import Entry, Node, Scalar, Table
from language.problem import Problems
from language.reader import Reader, about_of
from language.table import TableReader, section
from language.units import NO_UNIT, UNKNOWN_UNIT, Unit, parse_unit

FITTING_KEYS = ("neutral", "plain", "starts", "per", "form")
FORMS = ("constant", "constant_or_random_walk")
Per = Literal["model", "recording"]
Form = Literal["constant", "constant_or_random_walk"]


class ParameterReader(Reader):
    """Reads the section `parameters` of an automaton, `root`."""

    def __init__(self, problems: Problems, root: Table) -> None:
        """Report into `problems`."""
        super().__init__(problems)
        self.root = root
        self.declared = (section(root, "inputs"), section(root, "states"))

    def parameters(self) -> dict[str, Parameter]:
        """Return the parameters in the order of the file."""
        entries = self.named(self.root.get("parameters"), "parameters")
        return {entry.key: self._parameter(entry) for entry in entries}

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
        if unit is UNKNOWN_UNIT:
            limits = None  # told as no unit
        given = table.get("value")
        if limits and value is not None and given and not limits[0] <= value <= limits[1]:
            label = f"the value of `{entry.key}` is outside its range"
            self.problems.error("range", given.span, label)
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
        node, plain = table.get("neutral"), table.get("plain")
        neutral: Fraction | Literal["absent"] | None = None
        if isinstance(node, Scalar) and node.text == "absent":
            neutral = "absent"
        elif node is not None:
            neutral = self._inside(node, "neutral", "the neutral value", unit, limits)
        plainer = None
        if plain is not None:
            plainer = self._inside(plain, "plain", "the plain value", unit, limits)
        items = self.items(table.get("starts"), "starts")
        starts = [self._inside(item, "starts", "this start", unit, limits) for item in items]
        per = self.choice(table.get("per"), "per", ("model", "recording"), "model")
        form = self.choice(table.get("form"), "form", FORMS, "constant")
        return Fitting(neutral, tuple(starts), cast(Per, per), cast(Form, form), plainer)

    def _inside(
        self, node: Node, key: str, words: str, unit: Unit, limits: Range | None
    ) -> Fraction:
        """Return a value of a parameter that lies in its range."""
        value, _ = self.quantity(node, key, node.span, unit)
        if limits and not limits[0] <= value <= limits[1]:
            self.problems.error("range", node.span, f"{words} is outside the range")
        return value
