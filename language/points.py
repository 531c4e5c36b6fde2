"""Points: other values at the points of a table, as calibrations and commands give them."""

from __future__ import annotations

from collections.abc import Iterable

from language.document import Entry, MappingNode, ScalarNode, YamlNode
from language.number import round_to_type
from language.problem import Problems, suggest_name
from language.reader import Quantity, Reader
from language.tree import put_node
from language.units import NO_UNIT


def override_points(
    parameter: MappingNode, overrides: MappingNode, problems: Problems
) -> MappingNode:
    """Return a parameter with other values at some points of its table; none is new.

    A point may be written in another unit than the table's, `500 ms` for `0.5 s`; where it has no
    unit there it has none here.
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
        found = _merge_points(own, points, reader)
        return put_node(parameter, ("table", "points"), found)
    return parameter


def _merge_points(own: MappingNode, overrides: MappingNode, reader: Reader) -> MappingNode:
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
    """Return what stands at a point: a value, or a row of them."""
    if isinstance(own, MappingNode) and isinstance(entry.node, MappingNode):
        return _merge_points(own, entry.node, reader)
    if isinstance(own, MappingNode) or not isinstance(entry.node, ScalarNode):
        what = "a row of values" if isinstance(own, MappingNode) else "a value"
        reader.problems.error("form", entry.span, f"at `{entry.key}` the table has {what}")
        return own
    return entry.node


def _unknown_point_hint(key: str, own: MappingNode, known: str) -> str:
    return suggest_name(key, own.entries) or f"its points are {known}: change them in a variant"


def _find_point_key(own: MappingNode, entry: Entry, reader: Reader) -> str | None:
    """Return the key of the point that an entry is at."""
    if entry.key in own.entries:
        return entry.key
    given = reader.read_quantity(ScalarNode(entry.key, entry.span), entry.key, entry.span, None)
    quiet = Reader(Problems())
    keys: Iterable[tuple[str, Quantity]] = (
        (
            known.key,
            quiet.read_quantity(ScalarNode(known.key, known.span), known.key, known.span, None),
        )
        for known in own
    )
    return next((key for key, point in keys if _is_same_point(given, point)), None)


def _is_same_point(given: Quantity, point: Quantity) -> bool:
    (value, unit), (other, known) = given, point
    if (unit is NO_UNIT) != (known is NO_UNIT) or unit.dimension != known.dimension:
        return False
    return round_to_type(value) == round_to_type(other)


def overlay_value(old: YamlNode | None, new: YamlNode) -> YamlNode:
    """Return what is given for a parameter over what was before: of a table point by point."""
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
    entries = dict(before.entries)
    for entry in after:
        key = _find_point_key(before, entry, reader) or entry.key
        old = entries[key].node if key in entries else None
        node = entry.node
        if isinstance(old, MappingNode) and isinstance(node, MappingNode):
            node = _overlay_points(old, node, reader)
        entries[key] = Entry(key, entry.span, node)
    return MappingNode(entries, before.span)
