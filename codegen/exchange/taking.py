"""Taking: what a file says of the tunable parameters of an automaton, checked against its spec.

A value is taken where its name, type, unit and range are those of the spec. Tables stay those of
the spec, for no calibration can set one. Solved numbers are never taken.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from codegen.exchange.characteristic import (
    MAX_PROBLEMS,
    Axis,
    Cell,
    Characteristic,
    PageFile,
)
from codegen.exchange.exact import exact, unit_of
from codegen.exchange.page import axes_of, page_constants, page_name
from language.declaration import Parameter
from language.document import Scalar
from language.kind import LARGEST_WHOLE
from language.model import Automaton
from language.number import NumberType, decimal, rounded
from language.problem import Problems, Span, nearest
from language.program import Constant, Program, short
from language.units import NO_UNIT, Unit
from language.written import value_in_unit

PLACE = re.compile(r"\d{1,4}(\.0*)?", re.ASCII)
"""The number of a word in its list, as tools without words write it: `1`, `1.0000`."""
RemarkKind = Literal["rounded", "converted", "no unit", "not taken", "missing"]


@dataclass(frozen=True)
class Remark:
    """What is worth knowing of a name of the file: its place (None where it is absent), a text."""

    kind: RemarkKind
    name: str
    text: str
    span: Span | None = None


@dataclass(frozen=True)
class Taken:
    """Literals of the language by parameter, in the order of the page, and what is told of them.

    `solved` are the solved numbers of the file, in the working type, by the names of constants.
    """

    values: Mapping[str, Scalar]
    solved: Mapping[str, float]
    remarks: tuple[Remark, ...]


@dataclass(frozen=True)
class _Desk:
    """What is compared with, and what was found until now."""

    automaton: Automaton
    number: NumberType
    problems: Problems
    remarks: list[Remark] = field(default_factory=list)

    def remark(self, kind: RemarkKind, cell: Cell, text: str, at: Span | None = None) -> None:
        self.remarks.append(Remark(kind, cell.text, text, at or cell.span))


def taken(file: PageFile, automaton: Automaton, program: Program, problems: Problems) -> Taken:
    """Return what a file says of an automaton's page. Raises SpecError with all problems."""
    known = {page_name(program, constant): constant for constant in page_constants(program)}
    desk = _Desk(automaton, program.number, problems)
    given = _known(file, known, program.name, problems)
    values: dict[str, Scalar] = {}
    solved: dict[str, float] = {}
    for name, constant in known.items():
        if name not in given:
            stays = "" if constant.kind == "solved" else ": it stays as in the spec"
            desk.remarks.append(Remark("missing", name, f"is not in the file{stays}"))
        elif constant.kind == "solved":
            solved.update(_solved(given[name], constant, desk))
        else:
            literal = _literal(given[name], constant, desk)
            if literal is not None:
                values[short(constant.name)] = Scalar(literal, given[name].values[0].span)
    problems.stop_if_any()
    return Taken(values, solved, tuple(desk.remarks))


def _known(
    file: PageFile, known: Mapping[str, Constant], owner: str, problems: Problems
) -> dict[str, Characteristic]:
    """Return what has a name of the page; the first of the others are told with a name near it."""
    given: dict[str, Characteristic] = {}
    others = 0
    for one in file.characteristics:
        if one.name.text in known:
            given[one.name.text] = one
            continue
        others += 1
        hint = nearest(one.name.text, known) if others <= MAX_PROBLEMS else ""
        label = f"`{owner}` has no tunable parameter or solved number `{one.name.text}`"
        problems.error("name", one.name.span, label, hint)
    return given


def _solved(one: Characteristic, constant: Constant, desk: _Desk) -> dict[str, float]:
    cell = _single(one, desk.problems)
    number = exact(cell, desk.problems) if cell else None
    if cell is None or number is None:
        return {}
    value = _in_type(number, NO_UNIT, cell, desk)
    return {} if value is None else {constant.name: value}


def _literal(one: Characteristic, constant: Constant, desk: _Desk) -> str | None:
    """Return the value of a parameter as a calibration file has it, None where it is not taken."""
    parameter = desk.automaton.parameters[short(constant.name)]
    if parameter.table:
        _compare_table(one, constant, parameter, desk)
        return None
    cell = _single(one, desk.problems)
    if cell is None:
        return None
    if parameter.type == "real":
        value = _real(one, cell, parameter, desk)
    elif parameter.type == "int":
        value = _whole(cell, parameter, desk.problems)
    else:
        value = _word(cell, parameter, desk.problems)
    return None if value is None else value_in_unit(parameter, value, desk.number)


def _single(one: Characteristic, problems: Problems) -> Cell | None:
    if len(one.values) == 1 and not one.axes:
        return one.values[0]
    problems.error("form", one.name.span, f"`{one.name.text}` is a single value")
    return None


def _real(one: Characteristic, cell: Cell, parameter: Parameter, desk: _Desk) -> float | None:
    """Return a real in SI, in the working type and in its range; what was done to it is told."""
    unit = _unit(one, parameter.unit, one.unit, desk)
    number = exact(cell, desk.problems)
    if unit is None or number is None:
        return None
    value = _in_type(number, unit, cell, desk)
    if value is None:
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


def _unit(one: Characteristic, own: Unit, cell: Cell | None, desk: _Desk) -> Unit | None:
    unit = unit_of(cell, own, desk.problems)
    if unit and (cell is None or not cell.text.strip()) and not own.dimension.is_number:
        desk.remark("no unit", one.name, f"has no unit beside it: taken in {unit.text}")
    return unit


def _in_type(number: Fraction, unit: Unit, cell: Cell, desk: _Desk) -> float | None:
    """Return the value in SI of a number in a unit, None for one that is past the type."""
    value = rounded(number * unit.factor + unit.offset, desk.number)
    if abs(value) != float("inf"):
        return value
    desk.problems.error("number", cell.span, f"`{cell.text}` is out of the range of {desk.number}")
    return None


def _whole(cell: Cell, parameter: Parameter, problems: Problems) -> int | None:
    number = exact(cell, problems)
    if number is None:
        return None
    if number.denominator != 1:
        problems.error("type", cell.span, f"`{cell.text}` is not whole, `{parameter.name}` is")
        return None
    limits = parameter.range or (-LARGEST_WHOLE, LARGEST_WHOLE)
    if not limits[0] <= number <= limits[1]:
        label = f"`{parameter.name}` = {number} is outside its range, {limits[0]} to {limits[1]}"
        problems.error("range", cell.span, label)
        return None
    return int(number)


def _word(cell: Cell, parameter: Parameter, problems: Problems) -> int | None:
    """Return the place of a word in its list; a tool without words writes the place itself."""
    words = ("false", "true") if parameter.type == "bool" else parameter.values
    if cell.text in words:
        return words.index(cell.text)
    if PLACE.fullmatch(cell.text) and Fraction(cell.text) < len(words):
        return int(Fraction(cell.text))
    label = f"`{cell.text}` is not one of {', '.join(words)}"
    problems.error("choice", cell.span, label, nearest(cell.text, words))
    return None


def _compare_table(
    one: Characteristic, constant: Constant, parameter: Parameter, desk: _Desk
) -> None:
    """Report a table that is another one than that of the spec."""
    assert parameter.table
    told = len(desk.problems.found)
    unit = _unit(one, parameter.table.unit, one.unit, desk)
    is_same = unit is not None and len(one.values) == len(constant.items)
    if is_same and unit:
        is_same = all(
            _is_value(cell, unit, item, desk)
            for cell, item in zip(one.values, constant.items, strict=True)
        )
    if one.axes:
        is_same &= _have_points(one, parameter, desk)
    if is_same:
        text = "is a table, which no calibration can set: it stays that of the spec, an equal one"
        desk.remark("not taken", one.name, text)
    elif len(desk.problems.found) == told:
        label = f"`{one.name.text}` is another table than that of the spec"
        hint = "a calibration cannot set a table: change it in the spec, or in a variant"
        desk.problems.error("table", one.name.span, label, hint)


def _have_points(one: Characteristic, parameter: Parameter, desk: _Desk) -> bool:
    """Tell whether the axes of a file are those that are compiled in."""
    assert parameter.table
    own = axes_of(parameter.table, desk.number)
    if [len(axis.points) for axis in one.axes] != [len(axis.points) for axis in own]:
        return False
    return all(
        _has_points(one, axis, ours, declared.unit, desk)
        for axis, ours, declared in zip(one.axes, own, parameter.table.axes, strict=True)
    )


def _has_points(one: Characteristic, axis: Axis, ours: Axis, own: Unit, desk: _Desk) -> bool:
    unit = _unit(one, own, axis.unit, desk)
    return unit is not None and all(
        _is_value(cell, unit, rounded(Fraction(point.text), desk.number), desk)
        for cell, point in zip(axis.points, ours.points, strict=True)
    )


def _is_value(cell: Cell, unit: Unit, value: float, desk: _Desk) -> bool:
    number = exact(cell, desk.problems)
    return number is not None and _in_type(number, unit, cell, desk) == value
