"""Value conversion: converts values of a file to those of a parameter, with remarks."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from codegen.exchange.calibration.cell_parser import (
    is_blank_unit,
    parse_cell_number,
    parse_unit_cell,
)
from codegen.exchange.calibration.characteristic import Cell, FileCharacteristic
from language.expressions.units import Unit, UnitError, unit_hint
from language.ir.number_type import NumberType, round_to_type, shortest_decimal
from language.model.automaton import Automaton
from language.model.declaration import Parameter
from language.text.diagnostic import Problems, Span

RemarkKind = Literal["rounded", "converted", "no unit", "missing", "passed over", "skipped"]
"""The kinds of remarks."""


@dataclass(frozen=True)
class Remark:
    """A remark on a name of a file; `span` is None if the name is absent from the file."""

    kind: RemarkKind
    name: str
    text: str
    span: Span | None = None


@dataclass(frozen=True)
class ImportContext:
    """The automaton and number type of an import, with the problems and remarks found so far."""

    automaton: Automaton
    number: NumberType
    problems: Problems
    remarks: list[Remark] = field(default_factory=list)

    def add_remark(self, kind: RemarkKind, cell: Cell, text: str, at: Span | None = None) -> None:
        """Append a remark on a cell, at the position `at`, or at that of the cell.

        Its name is the text of the cell.
        """
        self.remarks.append(Remark(kind, cell.text, text, at or cell.span))

    def is_skipped(self, name: str) -> bool:
        """Tell whether a name of the file has a remark `skipped`."""
        return any(each.kind == "skipped" and each.name == name for each in self.remarks)


def convert_real(
    characteristic: FileCharacteristic,
    cell: Cell,
    unit: Unit,
    parameter: Parameter,
    context: ImportContext,
) -> float | None:
    """Return the value of a cell in SI units, rounded to the number type.

    `unit` is the unit of the cell; only its name in a remark comes from `characteristic`. A remark
    `converted` is added if the unit is no SI unit, else `rounded` if rounding changed the number.
    Returns None with a problem reported for a text that is not a number, for a number too large for
    the type, and for a value outside the range of the parameter.
    """
    number = parse_cell_number(cell, context.problems)
    value = None if number is None else convert_to_si(number, unit, cell, context)
    if number is None or value is None:
        return None
    shown = shortest_decimal(value, context.number)
    if unit.factor != 1 or unit.offset:
        si = f"{shown} {unit.dimension}".removesuffix(" 1")
        text = f"`{cell.text} {characteristic.unit.text if characteristic.unit else ''}` is {si}"
        context.add_remark("converted", characteristic.name, text, cell.span)
    elif number not in (Fraction(shown), Fraction(value)):
        text = f"`{cell.text}` is rounded to {shown}, its {context.number}"
        context.add_remark("rounded", characteristic.name, text, cell.span)
    limits = parameter.range
    if limits:
        low, high = (round_to_type(limit, context.number) for limit in limits)
        if not low <= value <= high:
            ends = " to ".join(shortest_decimal(end, context.number) for end in (low, high))
            label = f"`{characteristic.name.text}` = {shown} is outside its range, {ends} in SI"
            context.problems.error("range", cell.span, label)
            return None
    return value


def resolve_unit(
    characteristic: FileCharacteristic,
    declared_unit: Unit,
    cell: Cell | None,
    context: ImportContext,
) -> Unit | None:
    """Return the unit of values: that of `cell`, else the SI unit of `declared_unit`.

    If the file declares no unit, a remark `no unit` is added on the characteristic, unless the
    values are dimensionless. Returns None with a remark `skipped` if the unit is unknown, and with
    a problem reported if it is incompatible.
    """
    name = characteristic.name
    try:
        unit = parse_unit_cell(cell, declared_unit, context.problems)
    except UnitError as error:
        assert cell is not None
        hint = unit_hint(cell.text.strip())
        text = f"is not taken: {error}{f', {hint}' if hint else ''}"
        context.add_remark("skipped", name, text, cell.span)
        return None
    if unit and is_blank_unit(cell) and not declared_unit.dimension.is_number:
        context.add_remark("no unit", name, f"has no unit beside it: taken in {unit.text}")
    return unit


def convert_to_si(number: Fraction, unit: Unit, cell: Cell, context: ImportContext) -> float | None:
    """Return `number * factor + offset` of a unit, rounded to the number type of the context.

    Returns None with a problem reported at `cell` if it is too large for the type.
    """
    value = round_to_type(number * unit.factor + unit.offset, context.number)
    if abs(value) != float("inf"):
        return value
    context.problems.error(
        "number", cell.span, f"`{cell.text}` is out of the range of {context.number}"
    )
    return None
