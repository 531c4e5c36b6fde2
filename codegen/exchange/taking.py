"""Taking: what a file says of the tunable parameters of an automaton, checked against its spec.

A value is taken where its name, type, unit and range are those of the spec, values of a table where
its points are. Solved numbers are never taken.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from codegen.exchange.characteristic import (
    MAX_PROBLEMS,
    Cell,
    Characteristic,
    PageFile,
)
from codegen.exchange.desk import Desk, Remark, in_type, real_of, unit_beside
from codegen.exchange.exact import exact
from codegen.exchange.owned import Owned
from codegen.exchange.page import page_constants, page_name
from codegen.exchange.table import table_of
from language.declaration import Parameter
from language.document import Node, Scalar
from language.kind import LARGEST_WHOLE
from language.model import Automaton
from language.problem import Problems, nearest
from language.program import TICKS, Constant, Program, short
from language.units import NO_UNIT, parse_unit
from language.written import exact_in_unit, exact_text, value_in_unit

SECOND_UNIT = parse_unit("s")
NEAR = Fraction(1, 10**6)
"""Part by which the time of a tool may miss whole ticks: it has multiplied float32."""
PLACE = re.compile(r"\d{1,4}(\.0*)?", re.ASCII)
"""The number of a word in its list, as tools without words write it: `1`, `1.0000`."""


@dataclass(frozen=True)
class Taken:
    """Values of the language by parameter, in the order of the page, and what is told of them.

    `solved` are the solved numbers of the file, in the working type, by the names of constants.
    """

    values: Mapping[str, Node]
    solved: Mapping[str, float]
    remarks: tuple[Remark, ...]


def taken(
    file: PageFile,
    automaton: Automaton,
    program: Program,
    problems: Problems,
    owned: Owned,
) -> Taken:
    """Return what a file says of an automaton's page. Raises SpecError with all problems.

    What was passed over, since it is not `owned`, is told.
    """
    known = {page_name(program, constant): constant for constant in page_constants(program)}
    desk = Desk(automaton, program.number, problems)
    for other in owned.passed.values():
        desk.remark("passed over", other, "is of another function")
    if owned.passed and not file.characteristics:
        label = f"no name of this file begins with `{program.name}.`"
        problems.error("name", next(iter(owned.passed.values())).span, label)
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


def _solved(one: Characteristic, constant: Constant, desk: Desk) -> dict[str, float]:
    cell = _single(one, desk.problems)
    number = exact(cell, desk.problems) if cell else None
    if cell is None or number is None:
        return {}
    value = in_type(number, NO_UNIT, cell, desk)
    return {} if value is None else {constant.name: value}


def _value(one: Characteristic, constant: Constant, desk: Desk) -> Node | None:
    """Return the value of a parameter as a calibration file has it, None where it is not taken."""
    parameter = desk.automaton.parameters[short(constant.name)]
    if parameter.table:
        return table_of(one, constant, parameter, desk)
    cell = _single(one, desk.problems)
    if cell is None:
        return None
    if constant.unit == TICKS:
        return _in_ticks(one, cell, constant, desk)
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


def _real(one: Characteristic, cell: Cell, parameter: Parameter, desk: Desk) -> float | None:
    """Return a real in SI, in the working type and in its range; what was done to it is told."""
    unit = unit_beside(one, parameter.unit, one.unit, desk)
    return real_of(one, cell, unit, parameter, desk) if unit else None


def _in_ticks(one: Characteristic, cell: Cell, constant: Constant, desk: Desk) -> Node | None:
    """Return a tunable wait, a time of whole ticks; what is none is rounded up, and told."""
    assert desk.automaton.period and constant.range
    unit = unit_beside(one, SECOND_UNIT, one.unit, desk)
    number = exact(cell, desk.problems)
    if unit is None or number is None:
        return None
    asked = number * unit.factor / desk.automaton.period
    near = round(asked)
    is_whole = abs(asked - near) <= NEAR * max(near, 1)
    ticks = near if is_whole else math.ceil(asked)
    kept = ticks * desk.automaton.period
    if not is_whole:
        text = f"`{cell.text}` is rounded up to {exact_text(kept)} s, {ticks} ticks"
        desk.remark("rounded", one.name, text, cell.span)
    elif unit.factor != 1:
        told = f"`{cell.text} {one.unit.text if one.unit else ''}` is {exact_text(kept)} s"
        desk.remark("converted", one.name, told, cell.span)
    low, high = constant.range
    if not low <= ticks <= high or asked < -NEAR:
        ends = " to ".join(exact_text(int(end) * desk.automaton.period) for end in (low, high))
        label = f"`{one.name.text}` = {cell.text} {unit.text} is outside its range, {ends} s"
        desk.problems.error("range", cell.span, label)
        return None
    own = desk.automaton.parameters[short(constant.name)].unit
    return Scalar(exact_in_unit(kept, own), cell.span)


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
