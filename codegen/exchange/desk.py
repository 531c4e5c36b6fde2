"""Desk: a value of a file beside the parameter that it is for, and what is told of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from codegen.exchange.characteristic import Cell, Characteristic
from codegen.exchange.exact import exact, unit_of
from language.declaration import Parameter
from language.model import Automaton
from language.number import NumberType, decimal, rounded
from language.problem import Problems, Span
from language.units import Unit

RemarkKind = Literal["rounded", "converted", "no unit", "missing", "passed over"]


@dataclass(frozen=True)
class Remark:
    """What is worth knowing of a name of the file: its place (None where it is absent), a text."""

    kind: RemarkKind
    name: str
    text: str
    span: Span | None = None


@dataclass(frozen=True)
class Desk:
    """What is compared with, and what was found until now."""

    automaton: Automaton
    number: NumberType
    problems: Problems
    remarks: list[Remark] = field(default_factory=list)

    def remark(self, kind: RemarkKind, cell: Cell, text: str, at: Span | None = None) -> None:
        """Tell what is worth knowing of a cell."""
        self.remarks.append(Remark(kind, cell.text, text, at or cell.span))


def real_of(
    one: Characteristic, cell: Cell, unit: Unit, parameter: Parameter, desk: Desk
) -> float | None:
    """Return a value of a parameter, single or of a table, that is in a unit."""
    number = exact(cell, desk.problems)
    value = None if number is None else in_type(number, unit, cell, desk)
    if number is None or value is None:
        return None
    shown = decimal(value, desk.number)
    if unit.factor != 1 or unit.offset:
        si = f"{shown} {unit.dimension}".removesuffix(" 1")
        text = f"`{cell.text} {one.unit.text if one.unit else ''}` is {si}"
        desk.remark("converted", one.name, text, cell.span)
    elif number not in (Fraction(shown), Fraction(value)):
        text = f"`{cell.text}` is rounded to {shown}, its {desk.number}"
        desk.remark("rounded", one.name, text, cell.span)
    limits = parameter.range
    if limits:
        low, high = (rounded(limit, desk.number) for limit in limits)
        if not low <= value <= high:
            ends = f"{decimal(low, desk.number)} to {decimal(high, desk.number)}"
            label = f"`{one.name.text}` = {shown} is outside its range, {ends} in SI"
            desk.problems.error("range", cell.span, label)
            return None
    return value


def unit_beside(one: Characteristic, own: Unit, cell: Cell | None, desk: Desk) -> Unit | None:
    """Return the unit that stands beside values, a parameter's `own` where none does."""
    unit = unit_of(cell, own, desk.problems)
    if unit and (cell is None or not cell.text.strip()) and not own.dimension.is_number:
        desk.remark("no unit", one.name, f"has no unit beside it: taken in {unit.text}")
    return unit


def in_type(number: Fraction, unit: Unit, cell: Cell, desk: Desk) -> float | None:
    """Return the value in SI of a number in a unit, None for one that is past the type."""
    value = rounded(number * unit.factor + unit.offset, desk.number)
    if abs(value) != float("inf"):
        return value
    desk.problems.error("number", cell.span, f"`{cell.text}` is out of the range of {desk.number}")
    return None
