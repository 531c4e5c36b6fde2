"""Calibration: parameter values with where they come from, apart from the structure they fit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from language.document import Document, Entry, Node, Scalar, Table, require_kind
from language.points import overlaid
from language.problem import Problems, Span, nearest
from language.reader import Reader
from language.tree import at, put
from language.values import with_given

CALIBRATION_KEYS = ("language", "calibration", "of", "from", "date", "parameters")
VALUE_KEYS = ("value", "points", "std", "from", "date")
DATE = re.compile(r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])")


@dataclass(frozen=True)
class CalibratedValue:
    """A value of a parameter, its standard deviation and its origin as texts (empty: not told).

    Of a table the value is `{points: ...}`.
    """

    name: str
    value: Node
    std: str
    origin: str
    date: str
    span: Span


@dataclass(frozen=True)
class Calibration:
    """Values of the parameters of an automaton or system; `of` names it."""

    name: str
    of: Scalar
    values: Mapping[str, CalibratedValue]
    span: Span


def read_calibration(document: Document, problems: Problems) -> Calibration:
    """Read a calibration; its names are looked up by who uses it. Raises SpecError."""
    require_kind(document, "calibration", problems)
    return _CalibrationReader(problems).read(document)


def calibrated(
    tree: Table,
    calibration: Calibration,
    known: Mapping[str, Table],
    inner: Mapping[str, tuple[str, str]],
    problems: Problems,
) -> Table:
    """Return the tree of an automaton with the values of a calibration.

    `known` are its parameters by name, those of its model too, `inner` those of its instances: the
    instance and the parameter. Unknown ones are problems.
    """
    for name, value in calibration.values.items():
        if name in inner:
            tree = given_to(tree, inner[name], value.value)
        elif name not in known:
            report_unknown(calibration, value, {**known, **inner}, problems)
        elif "derived" in known[name].entries:
            label = f"`{name}` is derived: set what it follows from"
            problems.error("values", value.span, label)
        else:
            made = with_given(known[name], value.value, problems)
            tree = put(tree, ("parameters", name), made)
    return tree


def given_to(tree: Table, place: tuple[str, str], value: Node) -> Table:
    """Return the tree of a system or automaton in which an instance has another value.

    `place` is the instance and the parameter.
    """
    path = ("instances", place[0], "values", place[1])
    return put(tree, path, overlaid(at(tree, path), value))


def report_unknown(
    calibration: Calibration,
    value: CalibratedValue,
    known: Mapping[str, object],
    problems: Problems,
) -> None:
    """Report a value of a parameter that is not there."""
    label = f"`{calibration.of.text}` has no parameter `{value.name}`"
    problems.error("name", value.span, label, nearest(value.name, known))


class _CalibrationReader(Reader):
    """The sections of a calibration."""

    def read(self, document: Document) -> Calibration:
        tree = self.table(document.root, f"calibration {document.name}", CALIBRATION_KEYS)
        of = self.scalar(tree.get("of"), "of", document.name_span)
        origin, date = self._texts(tree)
        values = {}
        for entry in self.table(tree.get("parameters"), "parameters"):
            value = self._value(entry, origin, date)
            if value:
                values[entry.key] = value
        self.problems.stop_if_any()
        assert of is not None
        return Calibration(document.name, of, values, document.name_span)

    def _value(self, entry: Entry, origin: str, date: str) -> CalibratedValue | None:
        what = f"parameters.{entry.key}"
        if isinstance(entry.node, Scalar):
            return CalibratedValue(entry.key, entry.node, "", origin, date, entry.span)
        table = self.table(entry.node, what, VALUE_KEYS)
        if "points" in table.entries:
            return self._points(entry, table, origin, date)
        value = self.scalar(table.get("value"), f"{what}.value", entry.span)
        own, own_date = self._texts(table)
        node = table.get("std")
        if value is None:
            return None
        if node is not None:
            _, unit = self.quantity(value, f"{what}.value", value.span, None)
            size, _ = self.quantity(node, f"{what}.std", node.span, unit)
            if size < 0:
                self.problems.error("range", node.span, "`std` is not below zero")
        std = node.text if isinstance(node, Scalar) else ""
        return CalibratedValue(entry.key, value, std, own or origin, own_date or date, entry.span)

    def _points(self, entry: Entry, table: Table, origin: str, date: str) -> CalibratedValue:
        for key in ("value", "std"):
            if key in table.entries:
                label = f"a table has `points`, no `{key}`"
                self.problems.error("form", table.entries[key].span, label)
        own, own_date = self._texts(table)
        points = Table({"points": table.entries["points"]}, table.span)
        return CalibratedValue(entry.key, points, "", own or origin, own_date or date, entry.span)

    def _texts(self, table: Table) -> tuple[str, str]:
        texts = []
        for key in ("from", "date"):
            node = table.get(key)
            texts.append(self.text(node, key, node.span) if node else "")
        if texts[1] and not DATE.fullmatch(texts[1]):
            span = table.entries["date"].node.span
            self.problems.error("form", span, "a date is written as `2026-11-21`")
        return texts[0], texts[1]
