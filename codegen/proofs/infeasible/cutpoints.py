"""Cutpoints: places that cut the paths of a Program, and the variables known there.

A step is cut at its begin and end, and at the start of each iteration of a loop that every step
executes. The paths between two cutpoints have no cycle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from language.ir.ops import Block, Loop, RunBlock
from language.ir.program import Program
from language.ir.traversal import block_reads, reachable_blocks, walk_ops

PASSING = ("input", "is_new", "work", "calibration", "derived")
"""Groups of variables that each step sets anew."""


MOST_ITEMS = 8
"""Maximum number of elements of an array whose elements are separate variables."""


@dataclass(frozen=True, eq=False)
class Cutpoint:
    """A cutpoint with the variables that are known there.

    `loop` is None for that between two steps.
    """

    name: str
    names: tuple[str, ...]
    loop: Loop | None = None


@dataclass(frozen=True)
class CutpointState:
    """A cutpoint with symbolic values of its variables."""

    cut: Cutpoint
    values: Mapping[str, Any]


@dataclass(frozen=True)
class ExecutionPath:
    """A path between two cutpoints.

    `begin` is None for the first step. `given` are its conditions.
    """

    begin: CutpointState | None
    given: tuple[Any, ...]
    end: CutpointState


@dataclass(frozen=True)
class ConditionVisit:
    """An evaluation of a condition on a path, with the path conditions (`given`) at that point."""

    begin: CutpointState | None
    given: tuple[Any, ...]
    condition: Any


def step_cut(program: Program) -> Cutpoint:
    """Return the cutpoint between two steps."""
    read = {name for block in program.blocks.values() for name in block_reads(block)}
    whole = (v.name for v in program.variables if not v.size and v.name in read)
    return Cutpoint("step", tuple(name for name in whole if name.partition(".")[0] not in PASSING))


def loop_cut(program: Program, loop: Loop, number: int) -> Cutpoint:
    """Return the cutpoint at the start of a loop iteration, with all variables that are read."""
    read = {name for block in program.blocks.values() for name in block_reads(block)}
    fixed = {c.name for c in program.constants if c.kind == "fixed" or c.items}
    things = {v.name for v in (*program.variables, *program.inputs) if not v.size}
    things |= {c.name for c in program.constants}
    whole = (things & read) - fixed | {name for of in items_of(program).values() for name in of}
    return Cutpoint(f"loop {number}", (*sorted(whole - {loop.index}), loop.index), loop)


def items_of(program: Program) -> dict[str, tuple[str, ...]]:
    """Return the element names of small whole-number arrays that are set anew in each step."""
    small = (v for v in program.variables if v.type == "whole" and 0 < v.size <= MOST_ITEMS)
    passing = (v for v in small if v.name.partition(".")[0] in PASSING)
    return {v.name: tuple(f"{v.name}[{k}]" for k in range(v.size)) for v in passing}


def blocks_of(program: Program, block: Block) -> Iterator[Block]:
    """Yield a block and all blocks that it runs."""
    runs = {
        r
        for op in walk_ops(block)
        if isinstance(op, RunBlock)
        for r in reachable_blocks(op.block, program.blocks)
    }
    yield block
    yield from (program.blocks[run] for run in sorted(runs))
