"""Lean: a Program without the values that nothing reads, for code that shows its outputs alone."""

from __future__ import annotations

from codegen.harness import tunable_constants
from codegen.source import restrict_to_step
from codegen.unread import remove_dead_stores
from language.ir.program import Program

REMOVABLE_GROUPS = ("equation.", "work.")
"""What is set for those who look at an instance or at a step: beyond that nothing happens."""


def slice_to_outputs(program: Program) -> Program:
    """Return what C runs of a Program, less the equations that neither it nor an output reads.

    Its tunable parameters and inputs stay the same, or the Program does.
    """
    step_program = restrict_to_step(program)
    sliced = remove_dead_stores(step_program, REMOVABLE_GROUPS)
    return (
        sliced
        if _external_interface(sliced, restrict_to_step(sliced))
        == _external_interface(step_program, step_program)
        else step_program
    )


def _external_interface(program: Program, step_program: Program) -> tuple[object, ...]:
    """What a caller sets from outside: tunable parameters, and inputs as they are held in what is
    `step_program` of it.
    """
    held_inputs = (v.name for v in step_program.variables if v.name.startswith("before."))
    return *tunable_constants(program), *held_inputs
