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

    A point is the same however it is written: `0.5 s` is `500 ms`; a bare number has the unit of
    the other one.
    """
    reader = Reader(problems)
    points = reader.table(given, "a table's values", ("points",)).get("points")
    table = parameter.get("table")
    own = table.get("points") if isinstance(table, Table) else None
    if not isinstance(points, Table):
        label = "the values of a table are `{points: {...}}`"
        problems.error("form", given.span, label)
    elif not isinstance(own, Table):
        problems.error("form", given.span, "this parameter has no table", "it is a single value")
    else:
        found = _merged(own, points, reader)
        return put(parameter, ("table", "points"), found)
    return parameter


def _merged(own: Table, given: Table, reader: Reader) -> Table:
    entries = dict(own.entries)
    for entry in given:
        key = _point(own, entry, reader)
        if key is None:
            known = ", ".join(f"`{name}`" for name in own.entries)
            label = f"the table has no point `{entry.key}`"
            reader.problems.error("table", entry.span, label, _told(entry.key, own, known))
            continue
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
    if unit is NO_UNIT and known is not NO_UNIT:
        value = value * known.factor + known.offset
    elif known is NO_UNIT and unit is not NO_UNIT:
        other = other * unit.factor + unit.offset
    elif unit.dimension != known.dimension:
        return False
    return rounded(value) == rounded(other)
