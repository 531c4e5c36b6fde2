"""Reader: the helpers with which every kind of document is read into its model."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import cast

from language.aliases import as_mapping, habit, known_as
from language.declaration import Formula, Range
from language.document import Entry, Items, Node, Scalar, Table
from language.kind import LARGEST_WHOLE, TYPES, Type
from language.names import COMMA_HINT, check_name
from language.parse import parse_expression
from language.problem import Problems, Source, Span, nearest
from language.syntax import Broken, Negative, Number, Tree
from language.units import NO_UNIT, UNKNOWN_UNIT, Unit, UnitError, fits, parse_unit, unit_hint

NOWHERE = Span(Source(""), 0, 0)
"""The place of an absent mapping: nothing is ever reported there."""
TEXT_KEYS = frozenset({"about", "req"})
"""Keys that go on anything and have no influence."""


class Reader:
    """Reads parts of a document, reporting what is wrong into one collector."""

    def __init__(self, problems: Problems) -> None:
        """Report into `problems`."""
        self.problems = problems
        self.parsed: dict[tuple[int, str], tuple[Scalar, Formula]] = {}

    def table(self, node: Node | None, what: str, allowed: Iterable[str] | None = None) -> Table:
        """Return a mapping with known keys only; an empty one where the node is absent."""
        if node is None:
            return Table({}, NOWHERE)
        if not isinstance(node, Table):
            if not (isinstance(node, Scalar) and node.text == ""):
                hint = as_mapping(node, what)
                self.problems.error("form", node.span, f"`{what}` is a mapping", hint)
            return Table({}, node.span)
        known = None if allowed is None else {*allowed, *TEXT_KEYS}
        kept: dict[str, Entry] = {}
        for entry in node:
            if known is None or entry.key in known:
                kept[entry.key] = entry
                if entry.key == "req" and known is not None:
                    self._require_names(entry)
            else:
                self._unknown_key(entry, what, known)
        return Table(kept, node.span)

    def _require_names(self, entry: Entry) -> None:
        """Requirements are a name, or a list of names."""
        nodes = entry.node.nodes if isinstance(entry.node, Items) else (entry.node,)
        if not all(isinstance(node, Scalar) and node.text for node in nodes):
            label = "`req` is the name of a requirement, or a list of names"
            self.problems.error("form", entry.span, label, "like `req: [BL-3]`")

    def _unknown_key(self, entry: Entry, what: str, known: set[str]) -> None:
        hint = known_as(entry.key, known) or habit(entry.key, what) or nearest(entry.key, known)
        if not hint and isinstance(entry.node, Scalar) and not entry.node.text:
            hint = COMMA_HINT
        if not hint:
            hint = f"known here: {', '.join(sorted(known - TEXT_KEYS))}"
        label = f"`{entry.key}` is not a key of `{what}`"
        self.problems.error("unknown-key", entry.span, label, hint)

    def named(self, node: Node | None, what: str) -> Iterator[Entry]:
        """Iterate over the named things of a mapping, names checked."""
        for entry in self.table(node, what):
            check_name(entry.key, entry.span, self.problems)
            yield entry

    def scalar(self, node: Node | None, what: str, span: Span) -> Scalar | None:
        """Return a scalar, or report that it is missing or something else."""
        if node is None:
            self.problems.error("missing", span, f"`{what}` is missing")
        elif not isinstance(node, Scalar):
            self.problems.error("form", node.span, f"`{what}` is a single value")
        else:
            return node
        return None

    def text(self, node: Node | None, what: str, span: Span) -> str:
        """Return the text of a scalar, or an empty text with a problem reported."""
        scalar = self.scalar(node, what, span)
        return scalar.text if scalar else ""

    def kind_of(
        self, entry: Entry, key: str, kinds: Mapping[str, tuple[str, ...]], does: str
    ) -> tuple[str, Table] | None:
        """Return which of some kinds a thing is, and its keys; None with the problem reported.

        It has one key that names its kind, and beside it those that go with that kind.
        """
        told = len(self.problems.found)
        beside = {key for keys in kinds.values() for key in keys}
        table = self.table(entry.node, key, (*kinds, *beside))
        given = [key for key in table.entries if key in kinds]
        if len(given) == 1:
            return given[0], self.table(table, given[0], (given[0], *kinds[given[0]]))
        if len(self.problems.found) == told:
            place = table.entries[given[1]].span if given else entry.span
            label = f"`{entry.key}` {does} one thing"
            self.problems.error("form", place, label, f"one of {', '.join(kinds)}")
        return None

    def items(self, node: Node | None, what: str) -> list[Scalar]:
        """Return the scalars of a list."""
        if node is None:
            return []
        if not isinstance(node, Items):
            self.problems.error("form", node.span, f"`{what}` is a list")
            return []
        for item in node.nodes:
            if not isinstance(item, Scalar):
                self.problems.error("form", item.span, f"an item of `{what}` is a single value")
        return [item for item in node.nodes if isinstance(item, Scalar)]

    def choice(self, node: Node | None, what: str, allowed: Iterable[str], default: str) -> str:
        """Return one of the allowed words."""
        if node is None:
            return default
        text = self.text(node, what, node.span)
        known = list(allowed)
        if text and text not in known:
            label = f"`{text}` is not one of {', '.join(known)}"
            self.problems.error("choice", node.span, label, nearest(text, known))
            return default
        return text or default

    def whole(self, node: Node | None, what: str, default: int, low: int, high: int) -> int:
        """Return an integer between low and high."""
        if node is None:
            return default
        text = self.text(node, what, node.span)
        if not isinstance(node, Scalar):
            return default
        if not re.fullmatch(r"-?(0|[1-9]\d{0,9})", text) or not low <= int(text) <= high:
            label = f"`{what}` is a whole number from {low} to {high}"
            self.problems.error("number", node.span, label)
            return default
        return int(text)

    def unit(self, node: Node | None) -> Unit:
        """Return a unit, `1` where there is none."""
        if node is None:
            return NO_UNIT
        text = self.text(node, "unit", node.span)
        try:
            return parse_unit(text) if text else NO_UNIT
        except UnitError as error:
            self.problems.error("unit", node.span, str(error), unit_hint(text))
            return UNKNOWN_UNIT

    def expression(self, node: Node | None, key: str, span: Span) -> Formula | None:
        """Return an expression, or None with the problem reported.

        Every text is parsed once: what stands at the root is read again in each mode.
        """
        scalar = self.scalar(node, key.rpartition(".")[2], span)
        if scalar is None:
            return None
        if (id(scalar), key) not in self.parsed:
            self.parsed[id(scalar), key] = scalar, self._parse_once(scalar, key)
        return self.parsed[id(scalar), key][1]

    def _parse_once(self, scalar: Scalar, key: str) -> Formula:
        tree: Tree = Broken(scalar.span)
        with self.problems.collecting():
            tree = parse_expression(scalar)
        return Formula(tree, key)

    def formulas(self, node: Node | None, key: str) -> dict[str, Formula]:
        """Return the expressions of a mapping by their names; one with a problem is left out."""
        found = {}
        for entry in self.named(node, key):
            formula = self.expression(entry.node, f"{key}.{entry.key}", entry.span)
            if formula:
                found[entry.key] = formula
        return found

    def quantity(self, node: Node | None, what: str, span: Span, unit: Unit | None) -> Quantity:
        """Return a literal in SI and its unit; a bare number is in `unit` where one is given."""
        formula = self.expression(node, what, span)
        literal = _literal(formula.tree) if formula else None
        if formula and literal is None and not isinstance(formula.tree, Broken):
            label = f"`{what}` is a number with a unit, not an expression"
            self.problems.error("number", formula.span, label)
        if literal is None:
            return Fraction(0), unit or UNKNOWN_UNIT
        value, own = literal
        if unit is None:
            return value, own
        if own is NO_UNIT:
            return value * unit.factor + unit.offset, unit
        if not fits(own.dimension, unit.dimension):
            label = f"`{own.text}` does not fit the unit `{unit.text}`"
            self.problems.error("dimension", formula.span if formula else span, label)
        return value, own

    def typing(self, table: Table, what: str) -> tuple[Type, tuple[str, ...]]:
        """Return the `type` of a declaration, and the `values` of an enumeration."""
        kind = cast(Type, self.choice(table.get("type"), "type", TYPES, "real"))
        node = table.get("values")
        items = self.items(node, "values")
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

    def value(
        self, node: Node | None, what: str, span: Span, unit: Unit, kind: Type, names: Sequence[str]
    ) -> Fraction:
        """Return a literal of some type as a number: a quantity in SI, 0 or 1, or a place."""
        if kind == "real":
            return self.quantity(node, what, span, unit)[0]
        scalar = self.scalar(node, what, span)
        if scalar is None:
            return Fraction(0)
        if kind == "int":
            return Fraction(self.whole(scalar, what, 0, -LARGEST_WHOLE, LARGEST_WHOLE))
        known = ("false", "true") if kind == "bool" else tuple(names)
        text = self.choice(scalar, what, known, known[0] if known else "")
        return Fraction(known.index(text) if text in known else 0)

    def default(
        self, table: Table, key: str, unit: Unit, kind: Type, names: Sequence[str]
    ) -> Fraction | None:
        """Return the `default` of an input of some type; None where there is none."""
        node = table.get("default")
        if node is None:
            return None
        return self.value(node, f"{key}.default", node.span, unit, kind, names)

    def whole_range(self, limits: Range | None, node: Node | None) -> Range | None:
        """Return the range of whole numbers; one with a fraction or past 32 bits is reported."""
        if limits is None or node is None:
            return None
        if any(bound.denominator != 1 or abs(bound) > LARGEST_WHOLE for bound in limits):
            label = f"whole numbers lie from {-LARGEST_WHOLE} to {LARGEST_WHOLE}"
            self.problems.error("range", node.span, label)
            return None
        return limits

    def range(self, node: Node | None, unit: Unit) -> Range | None:
        """Return `[low, high]` in SI."""
        bounds = self.items(node, "range")
        if not isinstance(node, Items):
            return None
        if len(bounds) != 2:
            self.problems.error("form", node.span, "a range is `[low, high]`")
            return None
        low, high = (self.quantity(item, "range", item.span, unit)[0] for item in bounds)
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


def _literal(tree: Tree) -> tuple[Fraction, Unit] | None:
    match tree:
        case Number(value, unit, _):
            return value, unit
        case Negative(Number(value, unit, _), _):
            return 2 * unit.offset - value if unit.offset else -value, unit
        case _:
            return None


def about_of(table: Table) -> str:
    """Return the text that says what a thing is."""
    node = table.get("about")
    return node.text if isinstance(node, Scalar) else ""
