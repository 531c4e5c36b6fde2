"""Calibration: parameter values with their origin, stored apart from the automaton."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from language.expressions.name_rules import check_document_name
from language.overlays.parameter_override import overlay_value, override_parameter
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Document, Entry, MappingNode, ScalarNode, YamlNode, require_kind
from language.text.node_edit import find_node, put_node

CALIBRATION_KEYS = ("language", "calibration", "of", "from", "date", "parameters")
VALUE_KEYS = ("value", "points", "std", "from", "date")
DATE = re.compile(r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])")
"""A date in the form of ISO 8601."""


@dataclass(frozen=True)
class CalibratedValue:
    """A value of a parameter with its standard deviation, origin and date as texts.

    A missing text is empty. The value of a lookup table is a mapping `{points: ...}`.
    """

    name: str
    value: YamlNode
    std: str
    origin: str
    date: str
    span: Span


@dataclass(frozen=True)
class Calibration:
    """Values of the parameters of the automaton or system that `of` names."""

    name: str
    of: ScalarNode
    values: Mapping[str, CalibratedValue]
    span: Span


def read_calibration(document: Document, problems: Problems) -> Calibration:
    """Return the calibration of a document. Raises SpecError with all problems.

    A value without `from` or `date` has those of the file; missing texts are "". `of` and the form
    of values, dates (DATE) and standard deviations (not negative) are checked. Whether the
    parameters exist is checked when the calibration is applied.
    """
    require_kind(document, "calibration", problems)
    return _CalibrationReader(problems).read(document)


def apply_calibration(
    tree: MappingNode,
    calibration: Calibration,
    parameters: Mapping[str, MappingNode],
    instance_parameters: Mapping[str, tuple[str, str]],
    problems: Problems,
) -> MappingNode:
    """Return the tree of an automaton with the values of a calibration.

    `parameters` are the parameters of the automaton and of its model by name; a value for one of
    the model adds its overridden declaration to the tree. `instance_parameters` gives the instance
    and the parameter for names like `k1_t_close`, and has precedence; its value is set under
    `instances`.

    Unknown and derived parameters and values of the wrong form are reported, and their values are
    skipped.
    """
    for name, value in calibration.values.items():
        if name in instance_parameters:
            tree = set_instance_value(tree, instance_parameters[name], value.value)
        elif name not in parameters:
            report_unknown_parameter(
                calibration, value, {**parameters, **instance_parameters}, problems
            )
        elif "derived" in parameters[name].entries:
            label = f"`{name}` is derived: set the parameters that it reads"
            problems.error("values", value.span, label)
        else:
            overridden = override_parameter(parameters[name], value.value, problems)
            tree = put_node(tree, ("parameters", name), overridden)
    return tree


def set_instance_value(tree: MappingNode, place: tuple[str, str], value: YamlNode) -> MappingNode:
    """Return the tree of a system or automaton with another value for a parameter of an instance.

    `place` is the instance and the parameter: the path is
    `instances.<instance>.values.<parameter>`, which is created if missing. Points of a lookup table
    are merged with earlier ones. Nothing is checked.
    """
    path = ("instances", place[0], "values", place[1])
    return put_node(tree, path, overlay_value(find_node(tree, path), value))


def report_unknown_parameter(
    calibration: Calibration,
    value: CalibratedValue,
    candidates: Mapping[str, object],
    problems: Problems,
) -> None:
    """Report that the automaton or system of a calibration has no parameter of the name of `value`.

    The hint is the most similar name of `candidates`, if there is one.
    """
    label = f"`{calibration.of.text}` has no parameter `{value.name}`"
    problems.error("name", value.span, label, suggest_name(value.name, candidates))


class _CalibrationReader(Reader):
    """Reads the sections of a calibration."""

    def read(self, document: Document) -> Calibration:
        """Return the calibration of a document. Raises SpecError."""
        tree = self.read_mapping(document.root, f"calibration {document.name}", CALIBRATION_KEYS)
        check_document_name(document.name, document.name_span, self.problems)
        of = self.read_scalar(tree.get("of"), "of", document.name_span)
        origin, date = self._read_origin_and_date(tree)
        values = {}
        for entry in self.read_mapping(tree.get("parameters"), "parameters"):
            value = self._read_value(entry, origin, date)
            if value:
                values[entry.key] = value
        self.problems.raise_if_errors()
        assert of is not None
        return Calibration(document.name, of, values, document.name_span)

    def _read_value(self, entry: Entry, origin: str, date: str) -> CalibratedValue | None:
        """Return one value; by default it has the origin and date of the file.

        Returns None if the value is missing (reported). A negative standard deviation is reported.
        """
        what = f"parameters.{entry.key}"
        if isinstance(entry.node, ScalarNode):
            return CalibratedValue(entry.key, entry.node, "", origin, date, entry.span)
        table = self.read_mapping(entry.node, what, VALUE_KEYS)
        if "points" in table.entries:
            return self._read_points(entry, table, origin, date)
        value = self.read_scalar(table.get("value"), f"{what}.value", entry.span)
        own, own_date = self._read_origin_and_date(table)
        node = table.get("std")
        if value is None:
            return None
        if node is not None:
            _, unit = self.read_quantity(value, f"{what}.value", value.span, None)
            size, _ = self.read_quantity(node, f"{what}.std", node.span, unit)
            if size < 0:
                self.problems.error("range", node.span, "`std` is not below zero")
        std = node.text if isinstance(node, ScalarNode) else ""
        return CalibratedValue(entry.key, value, std, own or origin, own_date or date, entry.span)

    def _read_points(
        self, entry: Entry, table: MappingNode, origin: str, date: str
    ) -> CalibratedValue:
        """Return the values of a lookup table; keys of single values beside them are reported."""
        for key in ("value", "std"):
            if key in table.entries:
                label = f"a table has `points`, no `{key}`"
                self.problems.error("form", table.entries[key].span, label)
        own, own_date = self._read_origin_and_date(table)
        points = MappingNode({"points": table.entries["points"]}, table.span)
        return CalibratedValue(entry.key, points, "", own or origin, own_date or date, entry.span)

    def _read_origin_and_date(self, table: MappingNode) -> tuple[str, str]:
        """Return the texts of `from` and `date`, empty if absent; a wrong date is reported."""
        texts = []
        for key in ("from", "date"):
            node = table.get(key)
            texts.append(self.read_string(node, key, node.span) if node else "")
        if texts[1] and not DATE.fullmatch(texts[1]):
            span = table.entries["date"].node.span
            self.problems.error("form", span, "a date is written as `2026-11-21`")
        return texts[0], texts[1]
