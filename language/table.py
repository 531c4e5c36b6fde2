"""Table reader: a parameter with values over one or two axes, read by `lookup`."""

from __future__ import annotations

from fractions import Fraction

from language.declaration import Axis, LookupTable, Range
from language.document import Entry, Scalar, Table
from language.problem import Span
from language.reader import Reader
from language.units import NO_UNIT, Unit, UnitError, fits, parse_unit

Row = dict[Fraction, Fraction]


class TableReader(Reader):
    """Reads the `table` of a parameter; `declared` is what its axes may be named after."""

    declared: tuple[Table, ...] = ()

    def lookup_table(self, table: Table, key: str, limits: Range | None) -> LookupTable | None:
        """Return `{over: x, unit: u, points: {...}}`, or None with the problem reported."""
        unit = self.unit(table.get("unit"))
        names = self._axes(table)
        points = table.get("points")
        if not names or not isinstance(points, Table):
            label = "a table is `{over: x, unit: ..., points: {...}}`, or over `[x, y]`"
            self.problems.error("form", table.span, label)
            return None
        if len(names) == 1:
            row, axis = self._row(points, names[0], unit, key, limits)
            axes: tuple[Axis, ...] = (axis,)
            values = tuple(row.values())
        else:
            axes, values = self._rows(points, names, unit, key, limits)
        if any(len(axis.points) < 2 for axis in axes):
            self.problems.error("table", points.span, "a table has two points at least")
        return LookupTable(axes, unit, values)

    def _axes(self, table: Table) -> list[Scalar]:
        node = table.get("over")
        if isinstance(node, Scalar):
            return [node]
        return self.items(node, "over")[:2] if node is not None else []

    def _rows(
        self, points: Table, names: list[Scalar], unit: Unit, key: str, limits: Range | None
    ) -> tuple[tuple[Axis, ...], tuple[Fraction, ...]]:
        """Return both axes and the values, one row for each point of the first axis."""
        outer = self._axis_unit(names[0])
        first: dict[Fraction, Row] = {}
        second: Axis | None = None
        for entry in points:
            outer, at = self._point(entry, outer, key, list(first))
            row, axis = self._row(
                self.table(entry.node, f"{key}.{entry.key}"), names[1], unit, key, limits
            )
            if second is not None and axis.points != second.points:
                label = f"this row has other points of `{names[1].text}` than the first one"
                self.problems.error("table", entry.span, label)
            second = second or axis
            first[at] = row
        rows = tuple(value for row in first.values() for value in row.values())
        axis = Axis(names[0].text, outer or NO_UNIT, tuple(first), tuple(points.entries))
        return (axis, second or Axis(names[1].text, NO_UNIT, ())), rows

    def _row(
        self, points: Table, name: Scalar, unit: Unit, key: str, limits: Range | None
    ) -> tuple[Row, Axis]:
        axis_unit = self._axis_unit(name)
        found: Row = {}
        for entry in points:
            axis_unit, at = self._point(entry, axis_unit, key, list(found))
            value, _ = self.quantity(entry.node, f"{key}.{entry.key}", entry.span, unit)
            if limits and not limits[0] <= value <= limits[1]:
                self.problems.error("range", entry.node.span, "this value is outside the range")
            found[at] = value
        axis = Axis(name.text, axis_unit or NO_UNIT, tuple(found), tuple(points.entries))
        return found, axis

    def _point(
        self, entry: Entry, unit: Unit | None, key: str, before: list[Fraction]
    ) -> tuple[Unit, Fraction]:
        """Return the axis's unit and a point of it; a bare number is in the axis's unit."""
        scalar = Scalar(entry.key, entry.span)
        value, own = self.quantity(scalar, f"{key}.{entry.key}", entry.span, unit)
        if before and fits(own.dimension, (unit or own).dimension) and value <= before[-1]:
            label = f"`{entry.key}` is not above the point before it"
            self.problems.error("table", entry.span, label, "the points of an axis ascend")
        return unit or own, value

    def _axis_unit(self, name: Scalar) -> Unit | None:
        """Return the unit of the input or state that an axis is named after, if it is one."""
        for section in self.declared:
            thing = section.get(name.text)
            unit = thing.get("unit") if isinstance(thing, Table) else None
            if isinstance(unit, Scalar):
                try:
                    return parse_unit(unit.text)
                except UnitError:
                    return None
        return None


def section(tree: Table, name: str) -> Table:
    """Return a section of an automaton, an empty one where it is absent."""
    node = tree.get(name)
    return node if isinstance(node, Table) else Table({}, Span(tree.span.source, 0, 0))
