"""Calibration page: the tunable parameters of a Program and its solved numbers as characteristics.

Names are those of the C members behind the name of the automaton: `estimator.J_em`,
`estimator.solved.stamp_J_em`. Values are in SI units, as the shortest decimals of the number type.
"""

from __future__ import annotations

from codegen.emit.c_names import c_member
from codegen.exchange.calibration.characteristic import Cell, FileAxis, FileCharacteristic
from codegen.passes.step_restriction import restrict_to_step
from language.expressions.units import display_unit
from language.ir.number_type import NumberType, round_to_type, shortest_decimal
from language.ir.program import TICK_UNIT, Constant, Program, unqualified_name
from language.lowering.wait_ticks import ticks_to_seconds
from language.model.automaton import Automaton
from language.overlays.literal_format import format_exact
from language.typecheck.lookup_table import LookupTable

STAMP_PREFIX = "solved.stamp_"
"""The prefix of stamps: the parameter values for which solved numbers were computed (rule C15)."""


def page_constants(program: Program) -> tuple[Constant, ...]:
    """Return the constants of the page in its order: tunables, then solved numbers.

    Within each kind they are in Program order; those that the C does not use (`restrict_to_step`)
    are left out.
    """
    constants = restrict_to_step(program).constants
    return tuple(
        constant
        for kind in ("tunable", "solved")
        for constant in constants
        if constant.kind == kind
    )


def page_name(program: Program, constant: Constant) -> str:
    """Return the name of a constant of the page in files of calibration tools.

    It is `<program>.<member>`, for a solved number `<program>.solved.<member>`; the member is that
    of `c_member`.
    """
    within = "solved." if constant.kind == "solved" else ""
    return f"{program.name}.{within}{c_member(constant.name)}"


def page_characteristics(automaton: Automaton, program: Program) -> tuple[FileCharacteristic, ...]:
    """Return the page of an automaton's Program as characteristics with its values.

    They are in the order of `page_constants`. Values are texts in SI units; a wait, which the
    Program holds in ticks, is in seconds.
    """
    return tuple(_page_characteristic(automaton, program, c) for c in page_constants(program))


def format_constant_value(value: float, constant: Constant, number: NumberType) -> str:
    """Return a value of a constant as text in a file.

    A truth value is `true` or `false`, an enumeration index the name of its value, another whole
    number an integer, a real its shortest decimal in the number type, without its unit.
    """
    if constant.type == "truth":
        return "true" if value else "false"
    if constant.values:
        return constant.values[int(value)]
    return str(int(value)) if constant.type == "whole" else shortest_decimal(value, number)


def _page_characteristic(
    automaton: Automaton, program: Program, constant: Constant
) -> FileCharacteristic:
    """Return a constant of the page as a characteristic."""
    if constant.unit == TICK_UNIT:
        return _wait_as_time(automaton, program, constant)
    table = None
    if constant.kind == "tunable":
        table = automaton.parameters[unqualified_name(constant.name)].table
    items = constant.items or (constant.value,)
    is_text = constant.type == "truth" or bool(constant.values)
    has_unit = constant.type == "real" and (
        constant.kind == "tunable" or constant.name.startswith(STAMP_PREFIX)
    )
    return FileCharacteristic(
        Cell(page_name(program, constant)),
        tuple(Cell(format_constant_value(item, constant, program.number_type)) for item in items),
        Cell(display_unit(constant.unit)) if has_unit else None,
        axes_of(table, program.number_type) if table else (),
        is_text,
        constant.about,
    )


def _wait_as_time(automaton: Automaton, program: Program, constant: Constant) -> FileCharacteristic:
    """Return a tunable wait, which the page holds in ticks, as a characteristic in seconds."""
    parameter = automaton.parameters[unqualified_name(constant.name)]
    time = ticks_to_seconds(automaton, parameter, int(constant.value))
    name = Cell(page_name(program, constant))
    return FileCharacteristic(name, (Cell(format_exact(time)),), Cell("s"), about=constant.about)


def axes_of(table: LookupTable, number: NumberType) -> tuple[FileAxis, ...]:
    """Return the axes of a table with their points, rounded to the number type, in SI units."""
    return tuple(
        FileAxis(
            tuple(
                Cell(shortest_decimal(round_to_type(point, number), number))
                for point in axis.points
            ),
            Cell(display_unit(str(axis.unit.dimension))),
        )
        for axis in table.axes
    )
