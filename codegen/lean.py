"""Lean: a Program without the values that nothing reads, for code that shows its outputs alone."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from codegen.harness import tunable
from codegen.source import stepped
from language.operation import Assign, Op
from language.program import Program
from language.traversal import block_reads

SHOWN = ("equation.", "work.")
"""What is set for those who look at an instance or at a step: beyond that nothing happens."""


def lean(program: Program) -> Program:
    """Return what C runs of a Program, less the equations that neither it nor an output reads.

    Its tunable parameters and inputs stay the same, or the Program does.
    """
    whole = stepped(program)
    shown = {wire.source for wire in program.outputs}
    lines = {name: [_line(op) for op in block] for name, block in whole.blocks.items()}
    while True:
        every = (line for block in lines.values() for line in block)
        read = shown.union(*(line.reads for line in every))
        fewer = {name: [one for one in b if one.is_read(read)] for name, b in lines.items()}
        if fewer == lines:
            break
        lines = fewer
    blocks = {name: tuple(line.op for line in block) for name, block in lines.items()}
    made = dataclasses.replace(whole, blocks=blocks)
    return made if _page(made, stepped(made)) == _page(whole, whole) else whole


@dataclass(frozen=True)
class _Line:
    """An operation of a block with what it reads; `target` where it sets what may go."""

    op: Op
    reads: frozenset[str]
    target: str

    def is_read(self, read: set[str]) -> bool:
        """Tell whether it has to stay where so much is read."""
        return not self.target or self.target in read


def _line(op: Op) -> _Line:
    target = op.target if isinstance(op, Assign) and op.target.startswith(SHOWN) else ""
    return _Line(op, frozenset(block_reads((op,))), target)


def _page(program: Program, run: Program) -> tuple[object, ...]:
    """What a caller sets from outside: tunable parameters, and inputs as they are held in what is
    `run` of it.
    """
    held = (v.name for v in run.variables if v.name.startswith("before."))
    return *tunable(program), *held
