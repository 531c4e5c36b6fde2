"""Table import: the values of a table in a calibration file, if its points are the spec's."""

from __future__ import annotations

from fractions import Fraction

from codegen.exchange.calibration.calibration_page import axes_of
from codegen.exchange.calibration.cell_parser import is_blank_unit, parse_cell_number
from codegen.exchange.calibration.characteristic import Cell, FileAxis, FileCharacteristic
from codegen.exchange.calibration.value_conversion import (
    ImportContext,
    convert_real,
    convert_to_si,
    resolve_unit,
)
from language.expressions.units import Unit
from language.ir.number_type import round_to_type, shortest_decimal
from language.ir.program import Constant
from language.model.declaration import Parameter
from language.overlays.literal_format import table_points
from language.text.document import YamlNode


def read_table(
    characteristic: FileCharacteristic,
    constant: Constant,
    parameter: Parameter,
    context: ImportContext,
) -> YamlNode | None:
    """Return the values of a table as a node of a calibration overlay, at the points of the spec.

    A file without axes is accepted if the number of values is right. Points are compared in SI
    units after rounding to the number type. Returns None with problems reported if the file has
    other points or an invalid value. `parameter` must have a table.
    """
    assert parameter.table
    problem_count = len(context.problems.reported)
    difference = _axis_difference(characteristic, parameter, context) if characteristic.axes else ""
    if context.is_skipped(characteristic.name.text):
        return None
    if len(characteristic.values) != len(constant.items) or difference:
        if len(context.problems.reported) == problem_count:
            label = f"`{characteristic.name.text}` has other points than the table of the spec"
            hint = "a calibration holds the values at its points: change these in a variant"
            help = f"{difference}; {hint}" if difference else hint
            context.problems.error("table", characteristic.name.span, label, help)
        return None
    unit = resolve_unit(characteristic, parameter.table.unit, characteristic.unit, context)
    converted = (
        [
            convert_real(characteristic, cell, unit, parameter, context)
            for cell in characteristic.values
        ]
        if unit
        else []
    )
    values = [value for value in converted if value is not None]
    if len(values) < len(constant.items):
        return None
    return table_points(parameter, values, context.number, characteristic.values[0].span)


def _axis_difference(
    characteristic: FileCharacteristic, parameter: Parameter, context: ImportContext
) -> str:
    """Return how the axes in a file differ from the compiled ones; "" if they are equal.

    They may differ in number, length, and points.
    """
    assert parameter.table
    compiled_axes = axes_of(parameter.table, context.number)
    ours = [len(axis.points) for axis in compiled_axes]
    sizes = [len(axis.points) for axis in characteristic.axes]
    if sizes != ours:
        return f"it has {_join_sizes(sizes)} points, the spec {_join_sizes(ours)}"
    for axis, compiled, declared in zip(
        characteristic.axes, compiled_axes, parameter.table.axes, strict=True
    ):
        difference = _point_difference(characteristic, axis, compiled, declared.unit, context)
        if difference:
            return difference
    return ""


def _join_sizes(sizes: list[int]) -> str:
    """Return the numbers of points of axes as text, `3 x 2`."""
    return " x ".join(map(str, sizes))


def _point_difference(
    characteristic: FileCharacteristic,
    axis: FileAxis,
    compiled: FileAxis,
    declared_unit: Unit,
    context: ImportContext,
) -> str:
    """Return the first point of an axis that differs from the compiled one in SI units, or ""."""
    unit = resolve_unit(characteristic, declared_unit, axis.unit, context)
    if unit is None:
        return "its unit is another one"
    for cell, point in zip(axis.points, compiled.points, strict=True):
        value = round_to_type(Fraction(point.text), context.number)
        if not _is_equal(cell, unit, value, context):
            si = f"{shortest_decimal(value, context.number)} {declared_unit.dimension}"
            shown = f"{cell.text} {unit.text}".removesuffix(" 1")
            origin = ", read in SI without a unit," if is_blank_unit(axis.unit) else ""
            return f"its point {shown}{origin} is {si.removesuffix(' 1')} in the spec"
    return ""


def _is_equal(cell: Cell, unit: Unit, value: float, context: ImportContext) -> bool:
    """Tell whether a cell, converted to SI units and rounded to the number type, equals a value."""
    number = parse_cell_number(cell, context.problems)
    return number is not None and convert_to_si(number, unit, cell, context) == value
