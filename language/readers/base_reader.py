"""Reader: the base class of all readers, with methods for scalars, quantities, ranges and types.

A reader reports problems into one collector and continues with a default value.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import cast

from language.expressions.migration_hints import key_alias_hint, key_hint, mapping_hint
from language.expressions.name_rules import COMMA_HINT, check_name
from language.expressions.parser import parse_expression
from language.expressions.syntax_tree import ErrorNode, Negation, NumberLiteral, SyntaxTree
from language.expressions.units import (
    NO_UNIT,
    SECOND,
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
"""The place of an absent mapping; no problem is reported there."""
TEXT_KEYS = frozenset({"about", "req"})
"""Keys that every mapping may have and that have no influence."""


class Reader:
    """Reads parts of a document and reports problems into one collector."""

    def __init__(self, problems: Problems) -> None:
        """Report into `problems`; expressions are cached by scalar and key path."""
        self.problems = problems
        self.parsed_formulas: dict[tuple[ScalarNode, str], Formula] = {}

    def read_mapping(
        self, node: YamlNode | None, what: str, known_keys: Iterable[str] | None = None
    ) -> MappingNode:
        """Return a mapping without its unknown keys; an empty one for an absent or empty node.

        Unknown keys and a node that is no mapping are reported; `what` names the node. Known are
        `known_keys` and TEXT_KEYS; without `known_keys` all keys are allowed. A `req` that is no
        name or list of names is reported and kept.
        """
        if node is None:
            return MappingNode({}, NO_SPAN)
        if not isinstance(node, MappingNode):
            if not (isinstance(node, ScalarNode) and node.text == ""):
                hint = mapping_hint(node, what)
                self.problems.error("form", node.span, f"`{what}` is a mapping", hint)
            return MappingNode({}, node.span)
        known = None if known_keys is None else {*known_keys, *TEXT_KEYS}
        entries: dict[str, Entry] = {}
        for entry in node:
            if known is None or entry.key in known:
                entries[entry.key] = entry
                if entry.key == "req" and known is not None:
                    self._check_requirement_names(entry)
            else:
                self._report_unknown_key(entry, what, known)
        return MappingNode(entries, node.span)

    def _check_requirement_names(self, entry: Entry) -> None:
        """Report a value of `req` that is neither a name nor a list of names."""
        nodes = entry.node.nodes if isinstance(entry.node, SequenceNode) else (entry.node,)
        if not all(isinstance(node, ScalarNode) and node.text for node in nodes):
            label = "`req` is the name of a requirement, or a list of names"
            self.problems.error("form", entry.span, label, "like `req: [BL-3]`")

    def _report_unknown_key(self, entry: Entry, what: str, known: set[str]) -> None:
        """Report an unknown key with a hint.

        The hint is another spelling, a similar key, or the list of all known keys.
        """
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
        """Yield the entries of a mapping in the order of the file; an absent node has none.

        Keys that `check_name` rejects are reported, and yielded all the same. `what` names the
        node.
        """
        for entry in self.read_mapping(node, what):
            check_name(entry.key, entry.span, self.problems)
            yield entry

    def read_scalar(self, node: YamlNode | None, what: str, span: Span) -> ScalarNode | None:
        """Return a scalar; None with a problem reported if the node is absent or no scalar.

        `what` names the node; `span` is the place of the problem for an absent node. An empty
        scalar is returned.
        """
        if node is None:
            self.problems.error("missing", span, f"`{what}` is missing")
        elif not isinstance(node, ScalarNode):
            self.problems.error("form", node.span, f"`{what}` is a single value")
        else:
            return node
        return None

    def read_string(self, node: YamlNode | None, what: str, span: Span) -> str:
        """Return the text of a scalar; "" and a problem reported if it is absent or no scalar.

        `what` names the node; `span` is the place of the problem for an absent node. The text of an
        empty scalar is "", too, which is not reported.
        """
        scalar = self.read_scalar(node, what, span)
        return scalar.text if scalar else ""

    def read_reference(self, node: YamlNode, what: str) -> str:
        """Return the text of a scalar that names something; "" with a problem reported otherwise.

        Reported are a node that is no scalar, and an empty text. `what` names the node.
        """
        text = self.read_string(node, what, node.span)
        if isinstance(node, ScalarNode) and not text:
            self.problems.error("missing", node.span, f"`{what}` has no name")
        return text

    def check_file_name(self, name: str, span: Span, what: str) -> None:
        """Report a name of a file that is empty or has a control character, such as NUL.

        `what` names the key. Whether there is such a file is not checked.
        """
        if not name:
            self.problems.error("missing", span, f"`{what}` names no file")
        for character in name:
            if unicodedata.category(character) == "Cc":
                label = f"a file name has no control character, like U+{ord(character):04X} here"
                self.problems.error("name", span, label)
                return

    def read_alternative(
        self, entry: Entry, key: str, alternatives: Mapping[str, tuple[str, ...]], verb: str
    ) -> tuple[str, MappingNode] | None:
        """Return the kind of an entry, and its mapping; None if not exactly one kind is given.

        `alternatives` gives for each key that names a kind the keys that may be beside it; `key` is
        the key path. Keys of other kinds are reported and left out of the mapping. None is reported
        as "`<entry>` <verb> one thing", unless the entry has another reported problem.
        """
        problem_count = len(self.problems.reported)
        other_keys = {key for keys in alternatives.values() for key in keys}
        table = self.read_mapping(entry.node, key, (*alternatives, *other_keys))
        kinds = [key for key in table.entries if key in alternatives]
        if len(kinds) == 1:
            return kinds[0], self.read_mapping(table, kinds[0], (kinds[0], *alternatives[kinds[0]]))
        if len(self.problems.reported) == problem_count:
            place = table.entries[kinds[1]].span if kinds else entry.span
            label = f"`{entry.key}` {verb} one thing"
            self.problems.error("form", place, label, f"one of {', '.join(alternatives)}")
        return None

    def read_list(self, node: YamlNode | None, what: str) -> list[ScalarNode]:
        """Return the scalars of a list in its order; empty for an absent node.

        A node that is no list (also a single scalar) is reported and gives an empty list. Items
        that are no scalars are reported and left out. Repetitions are kept.
        """
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
        """Return one of the words `allowed`, or `default`.

        Returns `default` for an absent or empty node, and with a problem reported for an unknown
        word and a node that is no scalar. `default` need not be one of the words.
        """
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
        """Return an integer from `low` to `high`, both included.

        Returns `default` for an absent node and for any other value, which is reported. The literal
        is decimal, without a unit, a plus sign or leading zeros. `default` need not be within the
        bounds.
        """
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

    def read_duration(self, node: YamlNode | None, what: str) -> Fraction:
        """Return a time [s] that is not negative; 0 without a node. Reports other quantities."""
        if node is None:
            return Fraction(0)
        value, unit = self.read_quantity(node, what, node.span, None)
        if value < 0 or (value and not are_compatible(unit.dimension, SECOND)):
            self.problems.error("range", node.span, f"`{what}` is a time, like `15 ms`")
        return value

    def check_value_in_range(
        self, name: str, value: Fraction, limits: Range | None, unit: Unit, span: Span
    ) -> None:
        """Report a value of a parameter outside its range; both are in SI, the help is in `unit`.

        Without `limits` nothing is reported.
        """
        if limits and not limits[0] <= value <= limits[1]:
            low, high = ((bound - unit.offset) / unit.factor for bound in limits)
            hint = f"the range is {float(low):.9g} to {float(high):.9g} {unit.text}".removesuffix(
                " 1"
            )
            label = f"the value of `{name}` is outside its range"
            self.problems.error("range", span, label, hint)

    def read_unit(self, node: YamlNode | None) -> Unit:
        """Return a unit; `NO_UNIT` (1) if the node is absent, an empty text or no scalar.

        The last one is reported. An unknown unit is reported, too, and gives `UNKNOWN_UNIT`.
        """
        if node is None:
            return NO_UNIT
        text = self.read_string(node, "unit", node.span)
        try:
            return parse_unit(text) if text else NO_UNIT
        except UnitError as error:
            self.problems.error("unit", node.span, str(error), unit_hint(text))
            return UNKNOWN_UNIT

    def read_expression(self, node: YamlNode | None, key: str, span: Span) -> Formula | None:
        """Return an expression with its key path; None (reported) if it is absent or no scalar.

        A text that does not parse is reported and gives an `ErrorNode`. Results are cached by
        scalar and key, so that a section of the root that is read for each mode reports
        once.
        """
        scalar = self.read_scalar(node, key.rpartition(".")[2], span)
        if scalar is None:
            return None
        if (scalar, key) not in self.parsed_formulas:
            self.parsed_formulas[scalar, key] = self._parse_formula(scalar, key)
        return self.parsed_formulas[scalar, key]

    def _parse_formula(self, scalar: ScalarNode, key: str) -> Formula:
        """Return the parsed expression of a scalar; an `ErrorNode` with a problem reported."""
        tree: SyntaxTree = ErrorNode(scalar.span)
        with self.problems.collect_errors():
            tree = parse_expression(scalar)
        return Formula(tree, key)

    def read_formulas(self, node: YamlNode | None, key: str) -> dict[str, Formula]:
        """Return the expressions of a mapping by name, with the key paths `<key>.<name>`.

        Entries that are no scalars are reported and left out; wrong names are reported and kept. An
        absent node gives an empty dictionary.
        """
        formulas = {}
        for entry in self.named_entries(node, key):
            formula = self.read_expression(entry.node, f"{key}.{entry.key}", entry.span)
            if formula:
                formulas[entry.key] = formula
        return formulas

    def read_quantity(
        self, node: YamlNode | None, what: str, span: Span, unit: Unit | None
    ) -> Quantity:
        """Return a literal in SI and its unit; a bare number is in `unit`, or in 1 if that is None.

        A negative literal is one, too. Reported are a missing node (at `span`), an expression and a
        text that does not parse; they give 0 and `unit`, or `UNKNOWN_UNIT` if it is None. A unit of
        another dimension than `unit` is reported, and the value is returned with its own unit.
        """
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
        """Return the `type` of a declaration (default "real") and the `values` of an enum or ().

        `what` is the name of the declaration. Reported are an unknown type (gives "real"), a `unit`
        unless the type is real, a `range` of a bool or enum, an enum with less than two values,
        `values` of another type, and values that are repeated or no valid names.
        """
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
        """Return a literal of a type as a number: SI value, integer, 0 or 1, or index in `names`.

        `unit` is that of a bare real number. A missing or wrong literal is reported and gives 0; an
        int must be within +-MAX_INT. The range is not checked.
        """
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
        """Return the `default` of an input as by `read_typed_value`, or None if it has none.

        `key` is the key path of the input. A wrong literal is reported and gives 0.
        """
        node = table.get("default")
        if node is None:
            return None
        return self.read_typed_value(node, f"{key}.default", node.span, unit, type_name, names)

    def check_integer_range(self, value_range: Range | None, node: YamlNode | None) -> Range | None:
        """Return the range of an integer unchanged; None if `value_range` or `node` is None.

        `node` is the place of `range`. Bounds that are not whole or not within +-MAX_INT are
        reported and give None.
        """
        if value_range is None or node is None:
            return None
        if any(bound.denominator != 1 or abs(bound) > MAX_INT for bound in value_range):
            label = f"whole numbers lie from {-MAX_INT} to {MAX_INT}"
            self.problems.error("range", node.span, label)
            return None
        return value_range

    def read_range(self, node: YamlNode | None, unit: Unit) -> Range | None:
        """Return the bounds `[low, high]` in SI; bare numbers are in `unit`. None without a node.

        None with a problem reported if it is no list, has not two items, or low is not below high.
        """
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
"""A value in SI and the unit in which it is written."""


def _literal_value(tree: SyntaxTree) -> tuple[Fraction, Unit] | None:
    """Return the value (SI) and unit of a number literal, also of a negated one; None otherwise.

    In a unit with an offset the number is negated, not the SI value: -5 degC is 268.15 K.
    """
    match tree:
        case NumberLiteral(value, unit, _):
            return value, unit
        case Negation(NumberLiteral(value, unit, _), _):
            return 2 * unit.offset - value if unit.offset else -value, unit
        case _:
            return None
