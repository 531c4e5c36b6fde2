"""Taking: what a file says of the tunable parameters of an automaton, checked against its spec.

A value is taken where its name, type, unit and range are those of the spec, values of a table where
its points are. Solved numbers are never taken.
"""

from __future__ import annotations

import dataclasses
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
from language.document import Node, Scalar
from language.kind import LARGEST_WHOLE
from language.model import Automaton
from language.number import NumberType, decimal, rounded
from language.problem import Problems, Span, nearest
from language.program import Constant, Program, short
from language.units import NO_UNIT, Unit
from language.written import points_of, value_in_unit

PLACE = re.compile(r"\d{1,4}(\.0*)?", re.ASCII)
"""The number of a word in its list, as tools without words write it: `1`, `1.0000`."""
RemarkKind = Literal["rounded", "converted", "no unit", "missing", "passed over"]


@dataclass(frozen=True)
class Remark:
    """What is worth knowing of a name of the file: its place (None where it is absent), a text."""

    kind: RemarkKind
    name: str
    text: str
    span: Span | None = None


@dataclass(frozen=True)
class Taken:
    """Values of the language by parameter, in the order of the page, and what is told of them.

    `solved` are the solved numbers of the file, in the working type, by the names of constants.
    """

    values: Mapping[str, Node]
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


def taken(
    file: PageFile,
    automaton: Automaton,
    program: Program,
    problems: Problems,
    own_only: bool = False,
) -> Taken:
    """Return what a file says of an automaton's page. Raises SpecError with all problems.

    With `own_only` names that do not begin with the automaton's are passed over: they are of other
    functions of the ECU.
    """
    known = {page_name(program, constant): constant for constant in page_constants(program)}
    desk = _Desk(automaton, program.number, problems)
    if own_only:
        file = _own(file, program.name, desk)
    given = _known(file, known, program.name, problems)
    values: dict[str, Node] = {}
    solved: dict[str, float] = {}
    for name, constant in known.items():
        if name not in given:
            stays = "" if constant.kind == "solved" else ": it stays as in the spec"
            desk.remarks.append(Remark("missing", name, f"is not in the file{stays}"))
        elif constant.kind == "solved":
            solved.update(_solved(given[name], constant, desk))
        else:
            node = _value(given[name], constant, desk)
            if node is not None:
                values[short(constant.name)] = node
    problems.stop_if_any()
    return Taken(values, solved, tuple(desk.remarks))


def _own(file: PageFile, owner: str, desk: _Desk) -> PageFile:
    """Return what is the automaton's of a file that other functions of the ECU have values in."""
    own = tuple(one for one in file.characteristics if one.name.text.startswith(f"{owner}."))
    for one in file.characteristics:
        if not one.name.text.startswith(f"{owner}."):
            desk.remark("passed over", one.name, "is of another function")
    if file.characteristics and not own:
        label = f"no name of this file begins with `{owner}.`"
        desk.problems.error("name", file.characteristics[0].name.span, label)
    return dataclasses.replace(file, characteristics=own)


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


def _value(one: Characteristic, constant: Constant, desk: _Desk) -> Node | None:
    """Return the value of a parameter as a calibration file has it, None where it is not taken."""
    parameter = desk.automaton.parameters[short(constant.name)]
    if parameter.table:
        return _table(one, constant, parameter, desk)
    cell = _single(one, desk.problems)
    if cell is None:
        return None
    if parameter.type == "real":
        value = _real(one, cell, parameter, desk)
    elif parameter.type == "int":
        value = _whole(cell, parameter, desk.problems)
    else:
        value = _word(cell, parameter, desk.problems)
    if value is None:
        return None
    return Scalar(value_in_unit(parameter, value, desk.number), cell.span)


def _single(one: Characteristic, problems: Problems) -> Cell | None:
    if len(one.values) == 1 and not one.axes:
        return one.values[0]
    problems.error("form", one.name.span, f"`{one.name.text}` is a single value")
    return None


def _real(one: Characteristic, cell: Cell, parameter: Parameter, desk: _Desk) -> float | None:
    """Return a real in SI, in the working type and in its range; what was done to it is told."""
    unit = _unit(one, parameter.unit, one.unit, desk)
    return _item(one, cell, unit, parameter, desk) if unit else None


def _item(
    one: Characteristic, cell: Cell, unit: Unit, parameter: Parameter, desk: _Desk
) -> float | None:
    """Return a value of a parameter, single or of a table, that is in a unit."""
    number = exact(cell, desk.problems)
    value = None if number is None else _in_type(number, unit, cell, desk)
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


def _table(
    one: Characteristic, constant: Constant, parameter: Parameter, desk: _Desk
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
    unit = _unit(one, parameter.table.unit, one.unit, desk)
    found = [_item(one, cell, unit, parameter, desk) for cell in one.values] if unit else []
    values = [value for value in found if value is not None]
    if len(values) < len(constant.items):
        return None
    return points_of(parameter, values, desk.number, one.values[0].span)


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
