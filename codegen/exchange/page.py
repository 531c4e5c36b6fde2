"""Page: the calibration page of a Program as characteristics - tunables, then solved numbers.

The names are those that the C has, behind that of the automaton: `estimator.J_em`,
`estimator.solved.stamp_J_em`. Values are in SI, as the shortest decimals of the working type.
"""

from __future__ import annotations

from codegen.exchange.characteristic import Axis, Cell, Characteristic
from codegen.names import c_member
from codegen.source import stepped
from language.declaration import LookupTable
from language.model import Automaton
from language.number import NumberType, decimal, rounded
from language.program import TICKS, Constant, Program, short
from language.units import shown_unit
from language.written import exact_text

STAMP = "solved.stamp_"


def page_constants(program: Program) -> tuple[Constant, ...]:
    """Return the constants of the page in the order of its members."""
    constants = stepped(program).constants
    return tuple(
        constant
        for kind in ("tunable", "solved")
        for constant in constants
        if constant.kind == kind
    )


def page_name(program: Program, constant: Constant) -> str:
    """Return the name of a constant of the page in files of calibration tools."""
    within = "solved." if constant.kind == "solved" else ""
    return f"{program.name}.{within}{c_member(constant.name)}"


def page_of(automaton: Automaton, program: Program) -> tuple[Characteristic, ...]:
    """Return the page of an automaton's Program with its values."""
    return tuple(_characteristic(automaton, program, c) for c in page_constants(program))


def value_text(value: float, constant: Constant, number: NumberType) -> str:
    """Return a value of a constant as it stands in a file."""
    if constant.type == "truth":
        return "true" if value else "false"
    if constant.values:
        return constant.values[int(value)]
    return str(int(value)) if constant.type == "whole" else decimal(value, number)


def _characteristic(automaton: Automaton, program: Program, constant: Constant) -> Characteristic:
    if constant.unit == TICKS:
        return _as_time(automaton, program, constant)
    table = None
    if constant.kind == "tunable":
        table = automaton.parameters[short(constant.name)].table
    items = constant.items or (constant.value,)
    is_text = constant.type == "truth" or bool(constant.values)
    is_told = constant.type == "real" and (
        constant.kind == "tunable" or constant.name.startswith(STAMP)
    )
    return Characteristic(
        Cell(page_name(program, constant)),
        tuple(Cell(value_text(item, constant, program.number)) for item in items),
        Cell(shown_unit(constant.unit)) if is_told else None,
        axes_of(table, program.number) if table else (),
        is_text,
        constant.about,
    )


def _as_time(automaton: Automaton, program: Program, constant: Constant) -> Characteristic:
    """Return a tunable wait, which is kept in ticks, as the time that it is."""
    assert automaton.period
    time = int(constant.value) * automaton.period
    name = Cell(page_name(program, constant))
    return Characteristic(name, (Cell(exact_text(time)),), Cell("s"), about=constant.about)


def axes_of(table: LookupTable, number: NumberType) -> tuple[Axis, ...]:
    """Return the axes of a table as they are compiled in, in SI."""
    return tuple(
        Axis(
            tuple(Cell(decimal(rounded(point, number), number)) for point in axis.points),
            Cell(shown_unit(str(axis.unit.dimension))),
        )
        for axis in table.axes
    )
