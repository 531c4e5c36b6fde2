"""Table: the values of a table that a file has, taken where its points are those of the spec."""

from __future__ import annotations

from fractions import Fraction

from codegen.exchange.characteristic import Axis, Cell, Characteristic
from codegen.exchange.desk import Desk, in_type, real_of, unit_beside
from codegen.exchange.exact import exact
from codegen.exchange.page import axes_of
from language.declaration import Parameter
from language.document import Node
from language.number import rounded
from language.program import Constant
from language.units import Unit
from language.written import points_of


def table_of(
    one: Characteristic, constant: Constant, parameter: Parameter, desk: Desk
) -> Node | None:
    """Return the values of a table at its points, which are compiled in.

    None where it is no such table, which is reported.
    """
    assert parameter.table
    told = len(desk.problems.found)
    has_points = not one.axes or _have_points(one, parameter, desk)
    if len(one.values) != len(constant.items) or not has_points:
        if len(desk.problems.found) == told:
            label = f"`{one.name.text}` has other points than the table of the spec"
            hint = "a calibration holds the values at its points: change these in a variant"
            desk.problems.error("table", one.name.span, label, hint)
        return None
    unit = unit_beside(one, parameter.table.unit, one.unit, desk)
    found = [real_of(one, cell, unit, parameter, desk) for cell in one.values] if unit else []
    values = [value for value in found if value is not None]
    if len(values) < len(constant.items):
        return None
    return points_of(parameter, values, desk.number, one.values[0].span)


def _have_points(one: Characteristic, parameter: Parameter, desk: Desk) -> bool:
    """Tell whether the axes of a file are those that are compiled in."""
    assert parameter.table
    own = axes_of(parameter.table, desk.number)
    if [len(axis.points) for axis in one.axes] != [len(axis.points) for axis in own]:
        return False
    return all(
        _has_points(one, axis, ours, declared.unit, desk)
        for axis, ours, declared in zip(one.axes, own, parameter.table.axes, strict=True)
    )


def _has_points(one: Characteristic, axis: Axis, ours: Axis, own: Unit, desk: Desk) -> bool:
    unit = unit_beside(one, own, axis.unit, desk)
    return unit is not None and all(
        _is_value(cell, unit, rounded(Fraction(point.text), desk.number), desk)
        for cell, point in zip(axis.points, ours.points, strict=True)
    )


def _is_value(cell: Cell, unit: Unit, value: float, desk: Desk) -> bool:
    number = exact(cell, desk.problems)
    return number is not None and in_type(number, unit, cell, desk) == value
