"""Points: other values at the points of a table, as calibrations and commands give them."""

from __future__ import annotations

from collections.abc import Iterable

from language.document import Entry, Node, Scalar, Table
from language.number import rounded
from language.problem import Problems, nearest
from language.reader import Quantity, Reader
from language.tree import put
from language.units import NO_UNIT


def with_points(parameter: Table, given: Table, problems: Problems) -> Table:
    """Return a parameter with other values at some points of its table; none is new.

    A point may be written in another unit than the table's, `500 ms` for `0.5 s`; where it has no
    unit there it has none here.
    """
    reader = Reader(problems)
    points = reader.table(given, "a table's values", ("points",)).get("points")
    table = parameter.get("table")
    own = table.get("points") if isinstance(table, Table) else None
    if not isinstance(own, Table):
        problems.error("form", given.span, "this parameter has no table", "it is a single value")
    elif not isinstance(points, Table) or not points.entries:
        label = "the values of a table are `{points: {...}}`"
        problems.error("form", given.span, label)
    else:
        found = _merged(own, points, reader)
        return put(parameter, ("table", "points"), found)
    return parameter


def _merged(own: Table, given: Table, reader: Reader) -> Table:
    entries = dict(own.entries)
    first: dict[str, Entry] = {}
    for entry in given:
        key = _point(own, entry, reader)
        if key is None:
            known = ", ".join(f"`{name}`" for name in own.entries)
            label = f"the table has no point `{entry.key}`"
            reader.problems.error("table", entry.span, label, _told(entry.key, own, known))
            continue
        if key in first:
            label = f"`{entry.key}` is the point `{first[key].key}` again"
            reader.problems.error("duplicate", entry.span, label)
        first.setdefault(key, entry)
        entries[key] = Entry(key, entry.span, _value(entries[key].node, entry, reader))
    return Table(entries, own.span)


def _value(own: Node, entry: Entry, reader: Reader) -> Node:
    """Return what stands at a point: a value, or a row of them."""
    if isinstance(own, Table) and isinstance(entry.node, Table):
        return _merged(own, entry.node, reader)
    if isinstance(own, Table) or not isinstance(entry.node, Scalar):
        what = "a row of values" if isinstance(own, Table) else "a value"
        reader.problems.error("form", entry.span, f"at `{entry.key}` the table has {what}")
        return own
    return entry.node


def _told(key: str, own: Table, known: str) -> str:
    return nearest(key, own.entries) or f"its points are {known}: change them in a variant"


def _point(own: Table, entry: Entry, reader: Reader) -> str | None:
    """Return the key of the point that an entry is at."""
    if entry.key in own.entries:
        return entry.key
    given = reader.quantity(Scalar(entry.key, entry.span), entry.key, entry.span, None)
    quiet = Reader(Problems())
    keys: Iterable[tuple[str, Quantity]] = (
        (known.key, quiet.quantity(Scalar(known.key, known.span), known.key, known.span, None))
        for known in own
    )
    return next((key for key, point in keys if _is_same(given, point)), None)


def _is_same(given: Quantity, point: Quantity) -> bool:
    (value, unit), (other, known) = given, point
    if (unit is NO_UNIT) != (known is NO_UNIT) or unit.dimension != known.dimension:
        return False
    return rounded(value) == rounded(other)


def overlaid(old: Node | None, new: Node) -> Node:
    """Return what is given for a parameter over what was before: of a table point by point."""
    before = old.get("points") if isinstance(old, Table) else None
    after = new.get("points") if isinstance(new, Table) else None
    if not (isinstance(old, Table) and isinstance(before, Table) and isinstance(after, Table)):
        return new
    return put(old, ("points",), _over(before, after, Reader(Problems())))


def _over(before: Table, after: Table, reader: Reader) -> Table:
    entries = dict(before.entries)
    for entry in after:
        key = _point(before, entry, reader) or entry.key
        old = entries[key].node if key in entries else None
        node = entry.node
        if isinstance(old, Table) and isinstance(node, Table):
            node = _over(old, node, reader)
        entries[key] = Entry(key, entry.span, node)
    return Table(entries, before.span)
