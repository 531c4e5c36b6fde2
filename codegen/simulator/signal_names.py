"""Signal names: the C text of the signals of a system in a compiled simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.emit.c_expression import CNameMap, LocalNames, PlainNames, emit_expression
from codegen.emit.c_names import CNames
from language.ir.number_type import NumberType
from language.ir.ops import Assign
from language.ir.program import Program, unqualified_name
from language.programs.sensor_program import LAST_INPUT, LAST_OUTPUT, sensor_program
from language.programs.system_program import SimulationAssembly, output_variables

INSTANCE_NAME = "i_{}"
"""The C name of an instance or sensor, whose own name may be a keyword of C."""


@dataclass(frozen=True)
class SignalNameMap(PlainNames):
    """The C text of signals in the driver of a simulation.

    With `is_row` signals are read from the current row. With `is_timed` inputs that vary are
    evaluated at the variable `time`.
    """

    assembly: SimulationAssembly
    programs: Mapping[str, Program]
    is_row: bool = False
    is_timed: bool = False
    number: NumberType = "float64"

    def __call__(self, name: str) -> str:
        """Return the C text of the signal `signal.<name>`."""
        signal = unqualified_name(name)
        if self.is_row:
            return f"out[{self.assembly.row_signals.index(signal)}]"
        return self.emit_signal(signal)

    def emit_signal(self, name: str) -> str:
        """Return the C text of an input, a sensor value or an output `instance.signal`.

        With `is_timed` an input with a trajectory is evaluated at the variable `time`. `is_row` has
        no effect here. Raises KeyError for an unknown name.
        """
        courses = [course.name for course in self.assembly.input_trajectories]
        if self.is_timed and name in courses:
            return f"course_{courses.index(name)}(run, time)"
        if name in self.assembly.inputs:
            return f"run->inputs[{self.assembly.inputs.index(name)}]"
        if name in self.assembly.sensors:
            return f"run->{INSTANCE_NAME.format(name)}.value"
        owner, _, wire = name.partition(".")
        program = self.programs[owner]
        place = CNames(program)(output_variables(program)[wire])
        return place.replace("self->", f"(double)run->{program.name}.self.")

    def emit_formula(self, block: str) -> str:
        """Return the C text of the formula of a connection, a block of `assembly.wires`."""
        return emit_wire_formula(self.assembly, block, self)


def emit_wire_formula(assembly: SimulationAssembly, block: str, c_names: CNameMap) -> str:
    """Return the C text of a formula as a double; `block` is a block of `assembly.wires`.

    `c_names` gives the C text of its names. The block is one assignment.
    """
    (op,) = assembly.wires.blocks[block]
    assert isinstance(op, Assign)
    return f"(double)({emit_expression(op.value, c_names)})"


def sensor_formulas() -> dict[str, str]:
    """Return the C text of the blocks of the Program of sensors.

    The filter `lag` is a pointer to its state; all other names are local variables.
    """
    places = {LAST_INPUT: "lag->input", LAST_OUTPUT: "lag->value"}
    names = LocalNames(lambda name: places.get(name, unqualified_name(name)))
    blocks = sensor_program().blocks.items()
    assigned = [(block, op) for block, (op,) in blocks if isinstance(op, Assign)]
    return {block: emit_expression(op.value, names) for block, op in assigned}


def column_positions(assembly: SimulationAssembly) -> list[int]:
    """Return the position of each recorded column in a row, in the order of the columns.

    A column with a formula has its own position after all signals of the row; any other one has
    that of its signal.
    """
    positions, formulas = [], len(assembly.row_signals)
    for column in assembly.columns:
        if column.block:
            positions.append(formulas)
            formulas += 1
        else:
            positions.append(assembly.row_signals.index(column.source))
    return positions


def row_width(assembly: SimulationAssembly) -> int:
    """Return the number of values in a row, at least 1.

    These are the signals of the row, then the recorded columns with a formula.
    """
    return max(1, len(assembly.row_signals) + sum(1 for c in assembly.columns if c.block))
