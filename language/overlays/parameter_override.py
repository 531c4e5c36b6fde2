"""Parameter override: other values of parameters and of points of lookup tables.

Calibrations, effects, instances and command-line options give such values.
"""

from __future__ import annotations

from collections.abc import Iterable

from language.expressions.units import NO_UNIT
from language.ir.number_type import round_to_type
from language.readers.base_reader import Quantity, Reader
from language.text.diagnostic import Problems, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode
from language.text.node_edit import put_node


def override_points(
    parameter: MappingNode, overrides: MappingNode, problems: Problems
) -> MappingNode:
    """Return a parameter with other values at some points of its lookup table.

    `overrides` is `{points: {...}}`. A point may be written in another unit than in the table, such
    as `500 ms` for `0.5 s`. A number without a unit matches only the same text or a point without a
    unit.

    Reported are a parameter without a table and a wrong form (the parameter is returned unchanged),
    unknown points (skipped) and repeated points (the last value holds).
    """
    reader = Reader(problems)
    points = reader.read_mapping(overrides, "a table's values", ("points",)).get("points")
    table = parameter.get("table")
    own = table.get("points") if isinstance(table, MappingNode) else None
    if not isinstance(own, MappingNode):
        problems.error(
            "form", overrides.span, "this parameter has no table", "it is a single value"
        )
    elif not isinstance(points, MappingNode) or not points.entries:
        label = "the values of a table are `{points: {...}}`"
        problems.error("form", overrides.span, label)
    else:
        merged = _merge_points(own, points, reader)
        return put_node(parameter, ("table", "points"), merged)
    return parameter


def _merge_points(own: MappingNode, overrides: MappingNode, reader: Reader) -> MappingNode:
    """Return the points of an axis with other values; unknown and repeated points are reported."""
    entries = dict(own.entries)
    first: dict[str, Entry] = {}
    for entry in overrides:
        key = _find_point_key(own, entry, reader)
        if key is None:
            known = ", ".join(f"`{name}`" for name in own.entries)
            label = f"the table has no point `{entry.key}`"
            reader.problems.error(
                "table", entry.span, label, _unknown_point_hint(entry.key, own, known)
            )
            continue
        if key in first:
            label = f"`{entry.key}` is the point `{first[key].key}` again"
            reader.problems.error("duplicate", entry.span, label)
        first.setdefault(key, entry)
        entries[key] = Entry(key, entry.span, _override_value(entries[key].node, entry, reader))
    return MappingNode(entries, own.span)


def _override_value(own: YamlNode, entry: Entry, reader: Reader) -> YamlNode:
    """Return the new value at a point, or the merged row of a table with two axes.

    A value of the wrong form is reported, and the old one is returned.
    """
    if isinstance(own, MappingNode) and isinstance(entry.node, MappingNode):
        return _merge_points(own, entry.node, reader)
    if isinstance(own, MappingNode) or not isinstance(entry.node, ScalarNode):
        what = "a row of values" if isinstance(own, MappingNode) else "a value"
        reader.problems.error("form", entry.span, f"at `{entry.key}` the table has {what}")
        return own
    return entry.node


def _unknown_point_hint(key: str, own: MappingNode, known: str) -> str:
    """Return a similar point, or the list of all points, as a hint."""
    return suggest_name(key, own.entries) or f"its points are {known}: change them in a variant"


def _find_point_key(own: MappingNode, entry: Entry, reader: Reader) -> str | None:
    """Return the key of the point that an entry denotes, or None.

    The texts are compared first, then the values.
    """
    if entry.key in own.entries:
        return entry.key
    point_value = reader.read_quantity(
        ScalarNode(entry.key, entry.span), entry.key, entry.span, None
    )
    silent_reader = Reader(Problems())
    keys: Iterable[tuple[str, Quantity]] = (
        (
            known.key,
            silent_reader.read_quantity(
                ScalarNode(known.key, known.span), known.key, known.span, None
            ),
        )
        for known in own
    )
    return next((key for key, point in keys if _is_same_point(point_value, point)), None)


def _is_same_point(given: Quantity, point: Quantity) -> bool:
    """Tell whether two points have the same dimension and, in float64, the same value."""
    (value, unit), (other, known) = given, point
    if (unit is NO_UNIT) != (known is NO_UNIT) or unit.dimension != known.dimension:
        return False
    return round_to_type(value) == round_to_type(other)


def overlay_value(old: YamlNode | None, new: YamlNode) -> YamlNode:
    """Return the later of two values of a parameter; the points of lookup tables are merged.

    If both are `{points: ...}`, later points replace earlier ones of the same value, in any unit,
    and new points are added. Otherwise `new` is returned. Nothing is reported.
    """
    before = old.get("points") if isinstance(old, MappingNode) else None
    after = new.get("points") if isinstance(new, MappingNode) else None
    if not (
        isinstance(old, MappingNode)
        and isinstance(before, MappingNode)
        and isinstance(after, MappingNode)
    ):
        return new
    return put_node(old, ("points",), _overlay_points(before, after, Reader(Problems())))


def _overlay_points(before: MappingNode, after: MappingNode, reader: Reader) -> MappingNode:
    """Return earlier points overwritten by later ones, at any depth; new points are added."""
    entries = dict(before.entries)
    for entry in after:
        key = _find_point_key(before, entry, reader) or entry.key
        old = entries[key].node if key in entries else None
        node = entry.node
        if isinstance(old, MappingNode) and isinstance(node, MappingNode):
            node = _overlay_points(old, node, reader)
        entries[key] = Entry(key, entry.span, node)
    return MappingNode(entries, before.span)


def override_parameter(parameter: MappingNode, value: YamlNode, problems: Problems) -> MappingNode:
    """Return a parameter with another value, or with other values at points of its table.

    A value of the wrong form (a scalar for a table, a list) is reported, and the parameter is
    returned unchanged. A mapping is handled by `override_points`. The range is not checked.
    """
    if isinstance(value, ScalarNode) and "table" in parameter.entries:
        label = "this parameter is a table: its values are `{points: {...}}`"
        problems.error("form", value.span, label)
        return parameter
    if isinstance(value, ScalarNode):
        return set_parameter_value(parameter, value)
    if isinstance(value, MappingNode):
        return override_points(parameter, value, problems)
    problems.error(
        "form", value.span, "a value is a number with a unit, a word, or `{points: ...}`"
    )
    return parameter


def set_parameter_value(parameter: MappingNode, value: ScalarNode) -> MappingNode:
    """Return a parameter with another value; a bare number is in the unit of the old value.

    For this, a real parameter without `unit` gets the unit of the old literal, or 1. Nothing is
    checked.
    """
    entries = dict(parameter.entries)
    old, kind = parameter.get("value"), parameter.get("type")
    is_real = not isinstance(kind, ScalarNode) or kind.text == "real"
    if is_real and "unit" not in entries and isinstance(old, ScalarNode):
        _, _, unit = old.text.strip().partition(" ")
        span = entries["value"].span
        entries["unit"] = Entry("unit", span, ScalarNode(unit or "1", old.span))
    key = entries["value"].span if "value" in entries else parameter.span
    entries["value"] = Entry("value", key, value)
    return MappingNode(entries, parameter.span)
