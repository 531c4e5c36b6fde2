"""Lookup table reader: a parameter with values over one or two axes, read by `lookup`."""

from __future__ import annotations

from fractions import Fraction

from language.expressions.units import NO_UNIT, Unit, UnitError, are_compatible, parse_unit
from language.model.declaration import Range
from language.readers.base_reader import Reader
from language.text.diagnostic import Span
from language.text.document import Entry, MappingNode, ScalarNode
from language.typecheck.lookup_table import Axis, LookupTable

TableRow = dict[Fraction, Fraction]
"""The values of one axis (SI) by point (SI)."""


class LookupTableReader(Reader):
    """Reads the key `table` of a parameter.

    `axis_sections` are the sections whose variables give their units to axes of the same name.
    """

    axis_sections: tuple[MappingNode, ...] = ()

    def read_lookup_table(
        self, table: MappingNode, key: str, value_range: Range | None
    ) -> LookupTable | None:
        """Return the table `{over: x, unit: u, points: {...}}`, or None with a problem reported.

        None is returned only if `over` names no axis or `points` is no mapping. `over` is one name
        or a list, of which the first two count. `key` is the key path of the points. With two axes,
        `points` has a mapping for each point of the first axis, and the values are stored row by
        row.

        Reported, with the table returned: values outside `value_range` (SI), an axis with less than
        two points, points that do not ascend, and rows with other points than the first row.
        """
        unit = self.read_unit(table.get("unit"))
        names = self._read_axis_names(table)
        points = table.get("points")
        if not names or not isinstance(points, MappingNode):
            label = "a table is `{over: x, unit: ..., points: {...}}`, or over `[x, y]`"
            self.problems.error("form", table.span, label)
            return None
        if len(names) == 1:
            row, axis = self._read_row(points, names[0], unit, key, value_range)
            axes: tuple[Axis, ...] = (axis,)
            values = tuple(row.values())
        else:
            axes, values = self._read_rows(points, names, unit, key, value_range)
        if any(len(axis.points) < 2 for axis in axes):
            self.problems.error("table", points.span, "a table has two points at least")
        return LookupTable(axes, unit, values)

    def _read_axis_names(self, table: MappingNode) -> list[ScalarNode]:
        """Return at most two names of axes from `over`; an empty name is reported."""
        node = table.get("over")
        if isinstance(node, ScalarNode):
            names = [node]
        else:
            names = self.read_list(node, "over")[:2] if node is not None else []
        for name in names:
            self.read_reference(name, "over")
        return names

    def _read_rows(
        self,
        points: MappingNode,
        names: list[ScalarNode],
        unit: Unit,
        key: str,
        value_range: Range | None,
    ) -> tuple[tuple[Axis, ...], tuple[Fraction, ...]]:
        """Return the two axes, and the values row by row: the second axis varies fastest.

        Rows whose points differ from those of the first row are reported.
        """
        outer = self._find_axis_unit(names[0])
        first: dict[Fraction, TableRow] = {}
        second: Axis | None = None
        for entry in points:
            outer, point = self._read_point(entry, outer, key, list(first))
            row, axis = self._read_row(
                self.read_mapping(entry.node, f"{key}.{entry.key}"),
                names[1],
                unit,
                key,
                value_range,
            )
            if second is not None and axis.points != second.points:
                label = f"this row has other points of `{names[1].text}` than the first one"
                self.problems.error("table", entry.span, label)
            second = second or axis
            first[point] = row
        rows = tuple(value for row in first.values() for value in row.values())
        axis = Axis(names[0].text, outer or NO_UNIT, tuple(first), tuple(points.entries))
        return (axis, second or Axis(names[1].text, NO_UNIT, ())), rows

    def _read_row(
        self, points: MappingNode, name: ScalarNode, unit: Unit, key: str, value_range: Range | None
    ) -> tuple[TableRow, Axis]:
        """Return the values of one axis by point (SI), and the axis."""
        axis_unit = self._find_axis_unit(name)
        row: TableRow = {}
        for entry in points:
            axis_unit, point = self._read_point(entry, axis_unit, key, list(row))
            value, _ = self.read_quantity(entry.node, f"{key}.{entry.key}", entry.span, unit)
            if value_range and not value_range[0] <= value <= value_range[1]:
                self.problems.error("range", entry.node.span, "this value is outside the range")
            row[point] = value
        axis = Axis(name.text, axis_unit or NO_UNIT, tuple(row), tuple(points.entries))
        return row, axis

    def _read_point(
        self, entry: Entry, unit: Unit | None, key: str, previous_points: list[Fraction]
    ) -> tuple[Unit, Fraction]:
        """Return the unit of an axis and a point (SI); a bare number is in the unit of the axis.

        Without a known unit the first point determines it. A point that is not above the last of
        `previous_points` is reported.
        """
        scalar = ScalarNode(entry.key, entry.span)
        value, own = self.read_quantity(scalar, f"{key}.{entry.key}", entry.span, unit)
        if (
            previous_points
            and are_compatible(own.dimension, (unit or own).dimension)
            and value <= previous_points[-1]
        ):
            label = f"`{entry.key}` is not above the point before it"
            self.problems.error("table", entry.span, label, "the points of an axis ascend")
        return unit or own, value

    def _find_axis_unit(self, name: ScalarNode) -> Unit | None:
        """Return the unit of the variable that an axis is named after, or None."""
        for section in self.axis_sections:
            declaration = section.get(name.text)
            unit = declaration.get("unit") if isinstance(declaration, MappingNode) else None
            if isinstance(unit, ScalarNode):
                try:
                    return parse_unit(unit.text)
                except UnitError:
                    return None
        return None


def section_of(tree: MappingNode, name: str) -> MappingNode:
    """Return the section `name` at the root of a tree, or an empty mapping.

    It is empty if the section is absent or no mapping; nothing is reported.
    """
    node = tree.get(name)
    return node if isinstance(node, MappingNode) else MappingNode({}, Span(tree.span.source, 0, 0))
