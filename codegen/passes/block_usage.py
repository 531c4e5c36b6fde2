"""Block usage: the pointers that the C function of each block needs, and its local variables.

The analysis follows reads and writes of a block, directly and through the blocks that it runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.ir.definite_assignment import find_unassigned_reads
from language.ir.ops import Assign, Block, Branch, Loop, Switch
from language.ir.program import STEP_INTERFACE, Program
from language.ir.traversal import (
    block_reads,
    block_writes,
    called_blocks,
    reachable_blocks,
    walk_ops,
)
from language.model.graph_algorithms import post_order

POINTER_OF_GROUP = {
    "input": "in",
    "is_new": "in",
    "work": "work",
    "state": "self",
    "discrete": "self",
    "latched": "self",
    "equation": "self",
    "before": "self",
    "innovation": "self",
    "check": "self",
    "timer": "self",
    "memory": "self",
    "derived": "self",
}
"""The pointer parameter through which a function accesses a group of variables."""
PAGE_GROUPS = frozenset({"calibration"})
"""Groups of constants that are on the calibration page by default."""
POINTER_ORDER = ("self", "cal", "in", "work")
"""The order of pointer parameters."""


@dataclass(frozen=True)
class Usage:
    """The pointers that the function of a block needs, and those through which it writes."""

    needs: frozenset[str]
    writes: frozenset[str]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The needed pointers in the order of POINTER_ORDER."""
        return tuple(name for name in POINTER_ORDER if name in self.needs)


def block_usages(
    program: Program, local: Mapping[str, frozenset[str]], page_groups: frozenset[str] = PAGE_GROUPS
) -> dict[str, Usage]:
    """Return the usage of every block by name, including that of the blocks that it runs.

    `local` holds the local variables of each block, which need no pointer. `page_groups` are the
    groups of constants on the calibration page; names of other groups that are not in
    POINTER_OF_GROUP need no pointer.
    """
    groups = {**POINTER_OF_GROUP, **dict.fromkeys(page_groups, "cal")}
    usage_by_block: dict[str, Usage] = {}
    calls = {name: called_blocks(block) for name, block in program.blocks.items()}
    for name in post_order(calls):
        read = {n for n in block_reads(program.blocks[name]) if n not in local[name]}
        written = {n for n in block_writes(program.blocks[name]) if n not in local[name]}
        inner = [usage_by_block[called] for called in calls[name]]
        needs = {groups.get(n.partition(".")[0], "") for n in read | written} - {""}
        writes = {groups.get(n.partition(".")[0], "") for n in written} - {""}
        usage_by_block[name] = Usage(
            frozenset(needs).union(*(one.needs for one in inner)),
            frozenset(writes).union(*(one.writes for one in inner)),
        )
    return usage_by_block


def locals_of(
    program: Program, loop_variables: Mapping[str, frozenset[str]] | None = None
) -> dict[str, frozenset[str]]:
    """Return for each block the work variables that are local to its function.

    These are `work.` variables that the block assigns once and reads only later in the same list of
    operations, indices of its loops, and `loop_variables` (those of `loop_locals` if None). Arrays
    are never local, nor is a variable that some block uses in any other way.
    """
    assigned_once = {name: _assigned_once(block) for name, block in program.blocks.items()}
    shared = {variable.name for variable in program.variables if variable.size}
    for name, block in program.blocks.items():
        used = {n for n in (*block_reads(block), *block_writes(block)) if n.startswith("work.")}
        shared |= used - assigned_once[name]
    local_variables, loop_variables = (
        {},
        loop_locals(program) if loop_variables is None else loop_variables,
    )
    for name, block in program.blocks.items():
        loops = {op.index for op in walk_ops(block) if isinstance(op, Loop)}
        local_variables[name] = frozenset(
            (assigned_once[name] - shared) | loops | loop_variables[name]
        )
    return local_variables


def loop_locals(program: Program) -> dict[str, frozenset[str]]:
    """Return for each block the local work variables that are assigned in a loop of some block.

    Such a variable is assigned before it is read in every block that uses it, and no block that it
    runs uses it too. Arrays, loop indices and STEP_INTERFACE are excluded. A block without any has
    an empty set.
    """
    loops = [
        op for block in program.blocks.values() for op in walk_ops(block) if isinstance(op, Loop)
    ]
    candidates = {n for op in loops for n in block_writes(op.body) if n.startswith("work.")}
    candidates -= {
        *STEP_INTERFACE,
        *(op.index for op in loops),
        *(v.name for v in program.variables if v.size),
    }
    if not candidates:
        return dict.fromkeys(program.blocks, frozenset())
    accesses = {
        name: (candidates & set(block_reads(block)), candidates & set(block_writes(block)))
        for name, block in program.blocks.items()
    }
    for name, (read, written) in accesses.items():
        candidates -= read ^ written
        below = reachable_blocks(name, program.blocks) - {name}
        candidates -= read & {n for other in below for names in accesses[other] for n in names}
        candidates -= (
            find_unassigned_reads(program, name, frozenset(read & candidates))
            if read & candidates
            else set()
        )
    return {name: frozenset(read & candidates) for name, (read, _) in accesses.items()}


def _assigned_once(block: Block) -> set[str]:
    """Return the work variables assigned once, and read only later in the same list."""
    counts = Counter(op.target for op in walk_ops(block) if isinstance(op, Assign))
    outside = Counter(block_reads(block))
    names: set[str] = set()
    for ops in _nested_blocks(block):
        inside: Counter[str] = Counter()
        assigned: set[str] = set()
        for op in ops:
            fresh = Counter(block_reads((op,)))
            inside.update(fresh)
            if isinstance(op, Assign) and counts[op.target] == 1 and not inside[op.target]:
                assigned.add(op.target)
        names |= {n for n in assigned if n.startswith("work.") and 0 < inside[n] == outside[n]}
    return names


def _nested_blocks(block: Block) -> Iterator[Block]:
    """Yield a block, then all blocks inside its operations."""
    yield block
    for op in block:
        match op:
            case Branch(_, then, other):
                yield from _nested_blocks(then)
                yield from _nested_blocks(other)
            case Switch(_, cases):
                for _, case_block in cases:
                    yield from _nested_blocks(case_block)
            case Loop(_, _, body):
                yield from _nested_blocks(body)
            case _:
                pass
