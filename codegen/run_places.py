"""Run places: where the signals of a system are in the C of its runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.expression import Place, c_expression
from codegen.names import CNames
from language.assembly import Assembly, wires_of
from language.number import NumberType
from language.operation import Assign
from language.program import Program, short

INSTANCE = "i_{}"
"""What an instance is called in C: its name may be any that the language takes."""


@dataclass(frozen=True)
class Places:
    """Where signals are in the driver."""

    assembly: Assembly
    programs: Mapping[str, Program]
    is_row: bool = False
    is_timed: bool = False
    number: NumberType = "float64"

    def __call__(self, name: str) -> str:
        """Return the C text of `signal.<name>`."""
        signal = short(name)
        if self.is_row:
            return f"out[{self.assembly.slots.index(signal)}]"
        return self.signal(signal)

    def whole(self, name: str, number: int) -> str:
        """Return a whole number beside a signal."""
        return repr(number)

    def is_unsigned(self, name: str) -> bool:
        """Signals are reals."""
        return False

    def signal(self, name: str) -> str:
        """Return the C text of a signal."""
        courses = [course.name for course in self.assembly.courses]
        if self.is_timed and name in courses:
            return f"course_{courses.index(name)}(run, time)"
        if name in self.assembly.inputs:
            return f"run->inputs[{self.assembly.inputs.index(name)}]"
        if name in self.assembly.sensors:
            return f"run->{INSTANCE.format(name)}.value"
        owner, _, wire = name.partition(".")
        program = self.programs[owner]
        place = CNames(program)(wires_of(program)[wire])
        return place.replace("self->", f"(double)run->{program.name}.self.")

    def formula(self, block: str) -> str:
        """Return the C text of a block of the wires."""
        return formula_of(self.assembly, block, self)


def formula_of(assembly: Assembly, block: str, place: Place) -> str:
    """Return the C text of a block of the wires, whose signals are at a place."""
    (op,) = assembly.wires.blocks[block]
    assert isinstance(op, Assign)
    return f"(double)({c_expression(op.value, place)})"


@dataclass(frozen=True)
class Clock:
    """Where a formula of time reads it, whatever it is called there."""

    number: NumberType = "float64"

    def __call__(self, name: str) -> str:
        """Return the C text of the time."""
        return "now"

    def whole(self, name: str, number: int) -> str:
        """Return a whole number beside it."""
        return repr(number)

    def is_unsigned(self, name: str) -> bool:
        """Time is a real."""
        return False


def column_places(assembly: Assembly) -> list[int]:
    """Return where each recorded column stands among the numbers of a row."""
    found, formulas = [], len(assembly.slots)
    for column in assembly.columns:
        if column.block:
            found.append(formulas)
            formulas += 1
        else:
            found.append(assembly.slots.index(column.source))
    return found


def row_width(assembly: Assembly) -> int:
    """Return how many numbers a row has."""
    return max(1, len(assembly.slots) + sum(1 for c in assembly.columns if c.block))
