"""Lean: a Program without the values that nothing reads, for code that shows its outputs alone."""

from __future__ import annotations

from codegen.harness import tunable
from codegen.source import stepped
from codegen.unread import without_unread
from language.program import Program

SHOWN = ("equation.", "work.")
"""What is set for those who look at an instance or at a step: beyond that nothing happens."""


def lean(program: Program) -> Program:
    """Return what C runs of a Program, less the equations that neither it nor an output reads.

    Its tunable parameters and inputs stay the same, or the Program does.
    """
    whole = stepped(program)
    made = without_unread(whole, SHOWN)
    return made if _page(made, stepped(made)) == _page(whole, whole) else whole


def _page(program: Program, run: Program) -> tuple[object, ...]:
    """What a caller sets from outside: tunable parameters, and inputs as they are held in what is
    `run` of it.
    """
    held = (v.name for v in run.variables if v.name.startswith("before."))
    return *tunable(program), *held
