"""Page import: checks a calibration file against a spec and returns the values of its parameters.

A value is imported if its name, type, unit and range are those of the spec; the values of a table
if its axis points are. Solved numbers are returned apart and never become values of the spec.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from codegen.exchange.calibration.calibration_page import page_constants, page_name
from codegen.exchange.calibration.cell_parser import parse_cell_number
from codegen.exchange.calibration.characteristic import (
    MAX_PROBLEMS,
    Cell,
    FileCharacteristic,
    PageFile,
)
from codegen.exchange.calibration.name_filter import NameFilter
from codegen.exchange.calibration.table_import import read_table
from codegen.exchange.calibration.value_conversion import (
    ImportContext,
    Remark,
    convert_real,
    convert_to_si,
    resolve_unit,
)
from language.expressions.units import NO_UNIT, parse_unit
from language.ir.program import TICK_UNIT, Constant, Program, unqualified_name
from language.lowering.wait_ticks import ticks_to_seconds
from language.model.automaton import Automaton
from language.model.declaration import Parameter
from language.overlays.literal_format import (
    format_exact,
    format_exact_in_unit,
    format_value_in_unit,
)
from language.text.diagnostic import Problems, suggest_name
from language.text.document import ScalarNode, YamlNode
from language.typecheck.types import MAX_INT

SECOND_UNIT = parse_unit("s")
"""The unit of a wait."""
TICK_TOLERANCE = Fraction(1, 10**6)
"""Relative deviation of a time from whole ticks that is accepted, because tools compute in
float32.
"""
ENUM_INDEX = re.compile(r"\d{1,4}(\.0*)?", re.ASCII)
"""An enumeration value written as its index, by tools without enumerations: `1`, `1.0000`."""


@dataclass(frozen=True)
class ImportedValues:
    """The result of an import.

    `values` are values by parameter in the order of the page. `solved` are the solved numbers of
    the file, in the number type, by the names of constants.
    """

    values: Mapping[str, YamlNode]
    solved: Mapping[str, float]
    remarks: tuple[Remark, ...]


def import_values(
    file: PageFile,
    automaton: Automaton,
    program: Program,
    problems: Problems,
    name_filter: NameFilter,
) -> ImportedValues:
    """Return the values that a file gives for the page of an automaton, with remarks.

    Values of parameters are YAML nodes in the unit of the parameter. Names that the filter rejected
    have a remark `passed over`, constants that are not in the file a remark `missing`. Invalid
    values, names that are not on the page, and a file in which the filter rejected all names are
    errors. A value with an unknown unit is left out with a remark `skipped`; if no other value is
    left, it is an error. Raises SpecError at the end if any was reported to `problems`.
    """
    constants = {page_name(program, constant): constant for constant in page_constants(program)}
    context = ImportContext(automaton, program.number_type, problems)
    for other in name_filter.skipped.values():
        context.add_remark("passed over", other, "is of another function")
    if name_filter.skipped and not file.characteristics:
        label = f"no name of this file begins with `{program.name}.`"
        problems.error("name", next(iter(name_filter.skipped.values())).span, label)
    characteristics = _match_names(file, constants, program.name, problems)
    values: dict[str, YamlNode] = {}
    solved: dict[str, float] = {}
    for name, constant in constants.items():
        if name not in characteristics:
            stays = "" if constant.kind == "solved" else ": it stays as in the spec"
            context.remarks.append(Remark("missing", name, f"is not in the file{stays}"))
        elif constant.kind == "solved":
            solved.update(_read_solved(characteristics[name], constant, context))
        else:
            node = _read_value(characteristics[name], constant, context)
            if node is not None:
                values[unqualified_name(constant.name)] = node
    if not values:
        for remark in context.remarks:
            if remark.kind == "skipped" and remark.span:
                problems.error("unit", remark.span, f"`{remark.name}` {remark.text}")
    problems.raise_if_errors()
    return ImportedValues(values, solved, tuple(context.remarks))


def _match_names(
    file: PageFile, constants: Mapping[str, Constant], owner: str, problems: Problems
) -> dict[str, FileCharacteristic]:
    """Return the characteristics by name; report names that are not on the page.

    The first MAX_PROBLEMS reports suggest a similar name.
    """
    characteristics: dict[str, FileCharacteristic] = {}
    others = 0
    for one in file.characteristics:
        if one.name.text in constants:
            characteristics[one.name.text] = one
            continue
        others += 1
        hint = suggest_name(one.name.text, constants) if others <= MAX_PROBLEMS else ""
        label = f"`{owner}` has no tunable parameter or solved number `{one.name.text}`"
        problems.error("name", one.name.span, label, hint)
    return characteristics


def _read_solved(
    characteristic: FileCharacteristic, constant: Constant, context: ImportContext
) -> dict[str, float]:
    """Return a solved number by the name of its constant.

    Returns an empty dictionary with a problem reported if it is invalid.
    """
    cell = _require_single(characteristic, context.problems)
    number = parse_cell_number(cell, context.problems) if cell else None
    if cell is None or number is None:
        return {}
    value = convert_to_si(number, NO_UNIT, cell, context)
    return {} if value is None else {constant.name: value}


def _read_value(
    characteristic: FileCharacteristic, constant: Constant, context: ImportContext
) -> YamlNode | None:
    """Return the value of a parameter as a node of a calibration overlay.

    Returns None with problems reported if it is invalid.
    """
    parameter = context.automaton.parameters[unqualified_name(constant.name)]
    if parameter.table:
        return read_table(characteristic, constant, parameter, context)
    cell = _require_single(characteristic, context.problems)
    if cell is None:
        return None
    if constant.unit == TICK_UNIT:
        return _read_ticks(characteristic, cell, constant, context)
    if parameter.type == "real":
        value = _read_real(characteristic, cell, parameter, context)
    elif parameter.type == "int":
        value = _read_integer(cell, parameter, context.problems)
    else:
        value = _read_word(cell, parameter, context.problems)
    if value is None:
        return None
    return ScalarNode(format_value_in_unit(parameter, value, context.number), cell.span)


def _require_single(characteristic: FileCharacteristic, problems: Problems) -> Cell | None:
    """Return the only value of a characteristic without axes.

    Returns None with a problem reported otherwise.
    """
    if len(characteristic.values) == 1 and not characteristic.axes:
        return characteristic.values[0]
    problems.error(
        "form", characteristic.name.span, f"`{characteristic.name.text}` is a single value"
    )
    return None


def _read_real(
    characteristic: FileCharacteristic, cell: Cell, parameter: Parameter, context: ImportContext
) -> float | None:
    """Return a real value in SI units in the number type, with remarks on conversion and rounding.

    Returns None with a problem reported if it is invalid or outside its range.
    """
    unit = resolve_unit(characteristic, parameter.unit, characteristic.unit, context)
    return convert_real(characteristic, cell, unit, parameter, context) if unit else None


def _read_ticks(
    characteristic: FileCharacteristic, cell: Cell, constant: Constant, context: ImportContext
) -> YamlNode | None:
    """Return a tunable wait as a time of whole ticks, in the unit of its parameter.

    A time that is not a whole number of ticks is rounded up, with a remark. Returns None with a
    problem reported if it is invalid or outside its range.
    """
    assert context.automaton.period and constant.range
    unit = resolve_unit(characteristic, SECOND_UNIT, characteristic.unit, context)
    number = parse_cell_number(cell, context.problems)
    if unit is None or number is None:
        return None
    exact_ticks = number * unit.factor / context.automaton.period
    nearest_ticks = round(exact_ticks)
    is_whole = abs(exact_ticks - nearest_ticks) <= TICK_TOLERANCE * max(nearest_ticks, 1)
    ticks = nearest_ticks if is_whole else math.ceil(exact_ticks)
    parameter = context.automaton.parameters[unqualified_name(constant.name)]
    time = ticks_to_seconds(context.automaton, parameter, ticks)
    if not is_whole and number * unit.factor != time:
        text = f"`{cell.text}` is rounded up to {format_exact(time)} s, {ticks} ticks"
        context.add_remark("rounded", characteristic.name, text, cell.span)
    elif unit.factor != 1:
        unit_text = characteristic.unit.text if characteristic.unit else ""
        text = f"`{cell.text} {unit_text}` is {format_exact(time)} s"
        context.add_remark("converted", characteristic.name, text, cell.span)
    low, high = constant.range
    if not low <= ticks <= high or exact_ticks < -TICK_TOLERANCE:
        times = (ticks_to_seconds(context.automaton, parameter, int(end)) for end in (low, high))
        ends = " to ".join(format_exact(time) for time in times)
        label = (
            f"`{characteristic.name.text}` = {cell.text} {unit.text} is outside its range, {ends} s"
        )
        context.problems.error("range", cell.span, label)
        return None
    return ScalarNode(format_exact_in_unit(time, parameter.unit), cell.span)


def _read_integer(cell: Cell, parameter: Parameter, problems: Problems) -> int | None:
    """Return a whole number in its range; None with a problem reported for any other text."""
    number = parse_cell_number(cell, problems)
    if number is None:
        return None
    if number.denominator != 1:
        problems.error("type", cell.span, f"`{cell.text}` is not whole, `{parameter.name}` is")
        return None
    limits = parameter.range or (-MAX_INT, MAX_INT)
    if not limits[0] <= number <= limits[1]:
        label = f"`{parameter.name}` = {number} is outside its range, {limits[0]} to {limits[1]}"
        problems.error("range", cell.span, label)
        return None
    return int(number)


def _read_word(cell: Cell, parameter: Parameter, problems: Problems) -> int | None:
    """Return the index of a truth or enumeration value, given as a word or as the index itself.

    A truth value may have capital letters. Returns None with a problem reported for any other text.
    """
    words = ("false", "true") if parameter.type == "bool" else parameter.values
    word = cell.text.lower() if parameter.type == "bool" else cell.text
    if word in words:
        return words.index(word)
    if ENUM_INDEX.fullmatch(cell.text) and Fraction(cell.text) < len(words):
        return int(Fraction(cell.text))
    label = f"`{cell.text}` is not one of {', '.join(words)}"
    problems.error("choice", cell.span, label, suggest_name(cell.text, words))
    return None
