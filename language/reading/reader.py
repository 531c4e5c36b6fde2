"""Reader: the helpers with which every kind of document is read into its model."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import cast

from language.expressions.migration_hints import key_alias_hint, key_hint, mapping_hint
from language.expressions.name_rules import COMMA_HINT, check_name
from language.expressions.parser import parse_expression
from language.expressions.syntax_tree import ErrorNode, Negation, NumberLiteral, SyntaxTree
from language.expressions.units import (
    NO_UNIT,
    UNKNOWN_UNIT,
    Unit,
    UnitError,
    are_compatible,
    parse_unit,
    unit_hint,
)
from language.model.declaration import Formula, Range
from language.text.diagnostic import Problems, Source, Span, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.typecheck.types import MAX_INT, TYPE_NAMES, TypeName

NO_SPAN = Span(Source(""), 0, 0)
"""The place of an absent mapping: nothing is ever reported there."""
TEXT_KEYS = frozenset({"about", "req"})
"""Keys that go on anything and have no influence."""


class Reader:
    """Reads parts of a document, reporting what is wrong into one collector."""

    def __init__(self, problems: Problems) -> None:
        """Report into `problems`."""
        self.problems = problems
        self.parsed_formulas: dict[tuple[int, str], tuple[ScalarNode, Formula]] = {}

    def read_mapping(
        self, node: YamlNode | None, what: str, known_keys: Iterable[str] | None = None
    ) -> MappingNode:
        """Return a mapping with known keys only; an empty one where the node is absent."""
        if node is None:
            return MappingNode({}, NO_SPAN)
        if not isinstance(node, MappingNode):
            if not (isinstance(node, ScalarNode) and node.text == ""):
                hint = mapping_hint(node, what)
                self.problems.error("form", node.span, f"`{what}` is a mapping", hint)
            return MappingNode({}, node.span)
        known = None if known_keys is None else {*known_keys, *TEXT_KEYS}
        kept: dict[str, Entry] = {}
        for entry in node:
            if known is None or entry.key in known:
                kept[entry.key] = entry
                if entry.key == "req" and known is not None:
                    self._check_requirement_names(entry)
            else:
                self._report_unknown_key(entry, what, known)
        return MappingNode(kept, node.span)

    def _check_requirement_names(self, entry: Entry) -> None:
        """Requirements are a name, or a list of names."""
        nodes = entry.node.nodes if isinstance(entry.node, SequenceNode) else (entry.node,)
        if not all(isinstance(node, ScalarNode) and node.text for node in nodes):
            label = "`req` is the name of a requirement, or a list of names"
            self.problems.error("form", entry.span, label, "like `req: [BL-3]`")

    def _report_unknown_key(self, entry: Entry, what: str, known: set[str]) -> None:
        hint = (
            key_alias_hint(entry.key, known)
            or key_hint(entry.key, what)
            or suggest_name(entry.key, known)
        )
        if not hint and isinstance(entry.node, ScalarNode) and not entry.node.text:
            hint = COMMA_HINT
        if not hint:
            hint = f"known here: {', '.join(sorted(known - TEXT_KEYS))}"
        label = f"`{entry.key}` is not a key of `{what}`"
        self.problems.error("unknown-key", entry.span, label, hint)

    def named_entries(self, node: YamlNode | None, what: str) -> Iterator[Entry]:
        """Iterate over the named things of a mapping, names checked."""
        for entry in self.read_mapping(node, what):
            check_name(entry.key, entry.span, self.problems)
            yield entry

    def read_scalar(self, node: YamlNode | None, what: str, span: Span) -> ScalarNode | None:
        """Return a scalar, or report that it is missing or something else."""
        if node is None:
            self.problems.error("missing", span, f"`{what}` is missing")
        elif not isinstance(node, ScalarNode):
            self.problems.error("form", node.span, f"`{what}` is a single value")
        else:
            return node
        return None

    def read_string(self, node: YamlNode | None, what: str, span: Span) -> str:
        """Return the text of a scalar, or an empty text with a problem reported."""
        scalar = self.read_scalar(node, what, span)
        return scalar.text if scalar else ""

    def read_alternative(
        self, entry: Entry, key: str, alternatives: Mapping[str, tuple[str, ...]], verb: str
    ) -> tuple[str, MappingNode] | None:
        """Return which of some kinds a thing is, and its keys; None with the problem reported.

        It has one key that names its kind, and beside it those that go with that kind.
        """
        problem_count = len(self.problems.reported)
        beside = {key for keys in alternatives.values() for key in keys}
        table = self.read_mapping(entry.node, key, (*alternatives, *beside))
        given = [key for key in table.entries if key in alternatives]
        if len(given) == 1:
            return given[0], self.read_mapping(table, given[0], (given[0], *alternatives[given[0]]))
        if len(self.problems.reported) == problem_count:
            place = table.entries[given[1]].span if given else entry.span
            label = f"`{entry.key}` {verb} one thing"
            self.problems.error("form", place, label, f"one of {', '.join(alternatives)}")
        return None

    def read_list(self, node: YamlNode | None, what: str) -> list[ScalarNode]:
        """Return the scalars of a list."""
        if node is None:
            return []
        if not isinstance(node, SequenceNode):
            self.problems.error("form", node.span, f"`{what}` is a list")
            return []
        for item in node.nodes:
            if not isinstance(item, ScalarNode):
                self.problems.error("form", item.span, f"an item of `{what}` is a single value")
        return [item for item in node.nodes if isinstance(item, ScalarNode)]

    def read_choice(
        self, node: YamlNode | None, what: str, allowed: Iterable[str], default: str
    ) -> str:
        """Return one of the allowed words."""
        if node is None:
            return default
        text = self.read_string(node, what, node.span)
        known = list(allowed)
        if text and text not in known:
            label = f"`{text}` is not one of {', '.join(known)}"
            self.problems.error("choice", node.span, label, suggest_name(text, known))
            return default
        return text or default

    def read_integer(
        self, node: YamlNode | None, what: str, default: int, low: int, high: int
    ) -> int:
        """Return an integer between low and high."""
        if node is None:
            return default
        text = self.read_string(node, what, node.span)
        if not isinstance(node, ScalarNode):
            return default
        if not re.fullmatch(r"-?(0|[1-9]\d{0,9})", text) or not low <= int(text) <= high:
            label = f"`{what}` is a whole number from {low} to {high}"
            self.problems.error("number", node.span, label)
            return default
        return int(text)

    def read_unit(self, node: YamlNode | None) -> Unit:
        """Return a unit, `1` where there is none."""
        if node is None:
            return NO_UNIT
        text = self.read_string(node, "unit", node.span)
        try:
            return parse_unit(text) if text else NO_UNIT
        except UnitError as error:
            self.problems.error("unit", node.span, str(error), unit_hint(text))
            return UNKNOWN_UNIT

    def read_expression(self, node: YamlNode | None, key: str, span: Span) -> Formula | None:
        """Return an expression, or None with the problem reported.

        Every text is parsed once: what stands at the root is read again in each mode.
        """
        scalar = self.read_scalar(node, key.rpartition(".")[2], span)
        if scalar is None:
            return None
        if (id(scalar), key) not in self.parsed_formulas:
            self.parsed_formulas[id(scalar), key] = scalar, self._parse_formula(scalar, key)
        return self.parsed_formulas[id(scalar), key][1]

    def _parse_formula(self, scalar: ScalarNode, key: str) -> Formula:
        tree: SyntaxTree = ErrorNode(scalar.span)
        with self.problems.collect_errors():
            tree = parse_expression(scalar)
        return Formula(tree, key)

    def read_formulas(self, node: YamlNode | None, key: str) -> dict[str, Formula]:
        """Return the expressions of a mapping by their names; one with a problem is left out."""
        found = {}
        for entry in self.named_entries(node, key):
            formula = self.read_expression(entry.node, f"{key}.{entry.key}", entry.span)
            if formula:
                found[entry.key] = formula
        return found

    def read_quantity(
        self, node: YamlNode | None, what: str, span: Span, unit: Unit | None
    ) -> Quantity:
        """Return a literal in SI and its unit; a bare number is in `unit` where one is given."""
        formula = self.read_expression(node, what, span)
        literal = _literal_value(formula.tree) if formula else None
        if formula and literal is None and not isinstance(formula.tree, ErrorNode):
            label = f"`{what}` is a number with a unit, not an expression"
            self.problems.error("number", formula.span, label)
        if literal is None:
            return Fraction(0), unit or UNKNOWN_UNIT
        value, own = literal
        if unit is None:
            return value, own
        if own is NO_UNIT:
            return value * unit.factor + unit.offset, unit
        if not are_compatible(own.dimension, unit.dimension):
            label = f"`{own.text}` does not fit the unit `{unit.text}`"
            self.problems.error("dimension", formula.span if formula else span, label)
        return value, own

    def read_type(self, table: MappingNode, what: str) -> tuple[TypeName, tuple[str, ...]]:
        """Return the `type` of a declaration, and the `values` of an enumeration."""
        kind = cast(TypeName, self.read_choice(table.get("type"), "type", TYPE_NAMES, "real"))
        node = table.get("values")
        items = self.read_list(node, "values")
        for item in items:
            check_name(item.text, item.span, self.problems)
        if kind != "real" and "unit" in table.entries:
            label = f"`{what}` is {kind}: only a real has a unit"
            self.problems.error("form", table.entries["unit"].span, label)
        if kind in ("bool", "enum") and "range" in table.entries:
            label = f"`{what}` is {kind}: it has no range"
            self.problems.error("form", table.entries["range"].span, label)
        if kind == "enum" and len(items) < 2:
            place = node.span if node else table.span
            label = f"`{what}` is an enum: `values` lists its names, at least two"
            self.problems.error("missing", place, label, "like `values: [parked, ready]`")
        elif kind != "enum" and node is not None:
            label = "`values` belongs to `type: enum`"
            self.problems.error("form", table.entries["values"].span, label)
        names = tuple(item.text for item in items)
        if len(set(names)) < len(names):
            self.problems.error("duplicate", node.span if node else table.span, "a name twice")
        return kind, names if kind == "enum" else ()

    def read_typed_value(
        self,
        node: YamlNode | None,
        what: str,
        span: Span,
        unit: Unit,
        type_name: TypeName,
        names: Sequence[str],
    ) -> Fraction:
        """Return a literal of some type as a number: a quantity in SI, 0 or 1, or a place."""
        if type_name == "real":
            return self.read_quantity(node, what, span, unit)[0]
        scalar = self.read_scalar(node, what, span)
        if scalar is None:
            return Fraction(0)
        if type_name == "int":
            return Fraction(self.read_integer(scalar, what, 0, -MAX_INT, MAX_INT))
        known = ("false", "true") if type_name == "bool" else tuple(names)
        text = self.read_choice(scalar, what, known, known[0] if known else "")
        return Fraction(known.index(text) if text in known else 0)

    def read_default(
        self, table: MappingNode, key: str, unit: Unit, type_name: TypeName, names: Sequence[str]
    ) -> Fraction | None:
        """Return the `default` of an input of some type; None where there is none."""
        node = table.get("default")
        if node is None:
            return None
        return self.read_typed_value(node, f"{key}.default", node.span, unit, type_name, names)

    def check_integer_range(self, value_range: Range | None, node: YamlNode | None) -> Range | None:
        """Return the range of whole numbers; one with a fraction or past 32 bits is reported."""
        if value_range is None or node is None:
            return None
        if any(bound.denominator != 1 or abs(bound) > MAX_INT for bound in value_range):
            label = f"whole numbers lie from {-MAX_INT} to {MAX_INT}"
            self.problems.error("range", node.span, label)
            return None
        return value_range

    def read_range(self, node: YamlNode | None, unit: Unit) -> Range | None:
        """Return `[low, high]` in SI."""
        bounds = self.read_list(node, "range")
        if not isinstance(node, SequenceNode):
            return None
        if len(bounds) != 2:
            self.problems.error("form", node.span, "a range is `[low, high]`")
            return None
        low, high = (self.read_quantity(item, "range", item.span, unit)[0] for item in bounds)
        if low >= high:
            self.problems.error(
                "range",
                node.span,
                "the range is empty: low is not below high",
                "write the smaller bound first",
            )
            return None
        return low, high


Quantity = tuple[Fraction, Unit]


def _literal_value(tree: SyntaxTree) -> tuple[Fraction, Unit] | None:
    match tree:
        case NumberLiteral(value, unit, _):
            return value, unit
        case Negation(NumberLiteral(value, unit, _), _):
            return 2 * unit.offset - value if unit.offset else -value, unit
        case _:
            return None


def about_of(table: MappingNode) -> str:
    """Return the text that says what a thing is."""
    node = table.get("about")
    return node.text if isinstance(node, ScalarNode) else ""
