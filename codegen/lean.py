"""Lean: a Program without the values that nothing reads, for code that shows its outputs alone."""

from __future__ import annotations

import dataclasses

from codegen.harness import tunable
from codegen.source import stepped
from language.operation import Assign, Block
from language.program import Program
from language.traversal import block_reads

SHOWN = ("equation.", "work.")
"""What is set for those who look at an instance or at a step: beyond that nothing happens."""


def lean(program: Program) -> Program:
    """Return what C runs of a Program, less the equations that neither it nor an output reads.

    Its tunable parameters and inputs stay the same, or the Program does.
    """
    whole = stepped(program)
    blocks = dict(whole.blocks)
    shown = {wire.source for wire in program.outputs}
    while True:
        read = shown.union(*(block_reads(block) for block in blocks.values()))
        fewer = {name: _without(block, read) for name, block in blocks.items()}
        if fewer == blocks:
            break
        blocks = fewer
    made = dataclasses.replace(whole, blocks=blocks)
    return made if _page(made) == _page(whole) else whole


def _page(program: Program) -> tuple[object, ...]:
    """What a caller sets from outside: tunable parameters, and inputs as they are held."""
    held = (v.name for v in stepped(program).variables if v.name.startswith("before."))
    return *tunable(program), *held


def _without(block: Block, read: set[str]) -> Block:
    """Leave out the assignments, not inside others, of values that are not read."""
    return tuple(
        op
        for op in block
        if not (isinstance(op, Assign) and op.target.startswith(SHOWN) and op.target not in read)
    )
