"""Cut: where the ways of a Program are cut, and what may be known there.

A step is cut where it begins and ends, and each loop that every step comes by where a turn of it
begins: between two cuts there is no way back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from language.ir.ops import Block, Loop, RunBlock
from language.ir.program import Program
from language.ir.traversal import block_reads, reachable_blocks, walk_ops

PASSING = ("input", "is_new", "work", "calibration", "derived")
"""Groups of what each step brings or finds anew."""


MOST_ITEMS = 8
"""Most items of an array of whole numbers that are each a variable of their own."""


@dataclass(frozen=True, eq=False)
class Cutpoint:
    """A place with the variables that are known there; `loop` if it is where a turn begins."""

    name: str
    names: tuple[str, ...]
    loop: Loop | None = None


@dataclass(frozen=True)
class CutpointState:
    """A cut, and the values that variables have there."""

    cut: Cutpoint
    values: Mapping[str, Any]


@dataclass(frozen=True)
class ExecutionPath:
    """What leads from one cut, or from nowhere, to the next one: all that is `given`."""

    begin: CutpointState | None
    given: tuple[Any, ...]
    end: CutpointState


@dataclass(frozen=True)
class ConditionVisit:
    """A condition where a way comes by it, and what holds there."""

    begin: CutpointState | None
    given: tuple[Any, ...]
    condition: Any


def step_cut(program: Program) -> Cutpoint:
    """Return the cut between two steps."""
    read = {name for block in program.blocks.values() for name in block_reads(block)}
    whole = (v.name for v in program.variables if not v.size and v.name in read)
    return Cutpoint("step", tuple(name for name in whole if name.partition(".")[0] not in PASSING))


def loop_cut(program: Program, loop: Loop, number: int) -> Cutpoint:
    """Return the cut where a turn of a loop begins: all that is read anywhere is known."""
    read = {name for block in program.blocks.values() for name in block_reads(block)}
    fixed = {c.name for c in program.constants if c.kind == "fixed" or c.items}
    things = {v.name for v in (*program.variables, *program.inputs) if not v.size}
    things |= {c.name for c in program.constants}
    whole = (things & read) - fixed | {name for of in items_of(program).values() for name in of}
    return Cutpoint(f"loop {number}", (*sorted(whole - {loop.index}), loop.index), loop)


def items_of(program: Program) -> dict[str, tuple[str, ...]]:
    """Return the names of the items of small arrays that are written and read within a step."""
    small = (v for v in program.variables if v.type == "whole" and 0 < v.size <= MOST_ITEMS)
    passing = (v for v in small if v.name.partition(".")[0] in PASSING)
    return {v.name: tuple(f"{v.name}[{k}]" for k in range(v.size)) for v in passing}


def blocks_of(program: Program, block: Block) -> Iterator[Block]:
    """Yield a block, and all that it runs."""
    runs = {
        r
        for op in walk_ops(block)
        if isinstance(op, RunBlock)
        for r in reachable_blocks(op.block, program.blocks)
    }
    yield block
    yield from (program.blocks[run] for run in sorted(runs))
