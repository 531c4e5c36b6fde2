"""Table import: the values of a table in a calibration file, if its points are the spec's."""

from __future__ import annotations

from fractions import Fraction

from codegen.exchange.calibration.calibration_page import axes_of
from codegen.exchange.calibration.cell_parser import parse_cell_number
from codegen.exchange.calibration.characteristic import Cell, FileAxis, FileCharacteristic
from codegen.exchange.calibration.value_conversion import (
    ImportContext,
    convert_real,
    convert_to_si,
    resolve_unit,
)
from language.expressions.units import Unit
from language.ir.number_type import round_to_type
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
    has_points = not characteristic.axes or _has_equal_axes(characteristic, parameter, context)
    if len(characteristic.values) != len(constant.items) or not has_points:
        if len(context.problems.reported) == problem_count:
            label = f"`{characteristic.name.text}` has other points than the table of the spec"
            hint = "a calibration holds the values at its points: change these in a variant"
            context.problems.error("table", characteristic.name.span, label, hint)
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


def _has_equal_axes(
    characteristic: FileCharacteristic, parameter: Parameter, context: ImportContext
) -> bool:
    """Tell whether the axes in a file equal the compiled ones in number, length, and points."""
    assert parameter.table
    compiled_axes = axes_of(parameter.table, context.number)
    if [len(axis.points) for axis in characteristic.axes] != [
        len(axis.points) for axis in compiled_axes
    ]:
        return False
    return all(
        _has_equal_points(characteristic, axis, ours, declared.unit, context)
        for axis, ours, declared in zip(
            characteristic.axes, compiled_axes, parameter.table.axes, strict=True
        )
    )


def _has_equal_points(
    characteristic: FileCharacteristic,
    axis: FileAxis,
    compiled: FileAxis,
    declared_unit: Unit,
    context: ImportContext,
) -> bool:
    """Tell whether the points of an axis equal the compiled ones after conversion to SI units."""
    unit = resolve_unit(characteristic, declared_unit, axis.unit, context)
    return unit is not None and all(
        _is_equal(cell, unit, round_to_type(Fraction(point.text), context.number), context)
        for cell, point in zip(axis.points, compiled.points, strict=True)
    )


def _is_equal(cell: Cell, unit: Unit, value: float, context: ImportContext) -> bool:
    """Tell whether a cell, converted to SI units and rounded to the number type, equals a value."""
    number = parse_cell_number(cell, context.problems)
    return number is not None and convert_to_si(number, unit, cell, context) == value
