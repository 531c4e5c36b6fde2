"""Dead store elimination: a pass that removes assignments to variables that nothing reads.

  before                      after
  work.a := (x + y)           state.x := x
  work.b := (work.a * 2.0)
  state.x := x

Variables without a remaining assignment are removed from the Program.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from language.ir.ops import Assign, Block, Op
from language.ir.program import Program
from language.ir.traversal import block_reads, block_writes


def remove_dead_stores(program: Program, groups: tuple[str, ...]) -> Program:
    """Return a Program without assignments to variables in `groups` that nothing reads.

    `groups` are prefixes of names, like `work.`. The pass repeats until no assignment is removed.
    Sources of outputs count as read. Assignments inside branches, switches and loops stay.
    Variables without a remaining assignment are removed from the Program.
    """
    output_sources = {wire.source for wire in program.outputs}
    reads_by_block = {
        name: [_op_reads(op, groups) for op in b] for name, b in program.blocks.items()
    }
    while True:
        read = output_sources.union(
            *(line.reads for block in reads_by_block.values() for line in block)
        )
        remaining = {
            name: [one for one in b if one.is_live(read)] for name, b in reads_by_block.items()
        }
        if remaining == reads_by_block:
            break
        reads_by_block = remaining
    blocks = {name: tuple(line.op for line in block) for name, block in reads_by_block.items()}
    removed = _written_names(program.blocks) - _written_names(blocks) - read
    variables = tuple(v for v in program.variables if v.name not in removed)
    return dataclasses.replace(program, blocks=blocks, variables=variables)


@dataclass(frozen=True)
class _OpReads:
    """An operation of a block with the names that it reads.

    `target` is the assigned variable if the operation may be removed, else empty.
    """

    op: Op
    reads: frozenset[str]
    target: str

    def is_live(self, read: set[str]) -> bool:
        """Tell whether the operation must stay, given the set of all names that are read."""
        return not self.target or self.target in read


def _op_reads(op: Op, groups: tuple[str, ...]) -> _OpReads:
    """Return an operation with its reads.

    A removable one is an assignment to a variable in `groups`.
    """
    target = op.target if isinstance(op, Assign) and op.target.startswith(groups) else ""
    return _OpReads(op, frozenset(block_reads((op,))), target)


def _written_names(blocks: Mapping[str, Block]) -> set[str]:
    """Return the names that any of the blocks writes."""
    return {name for block in blocks.values() for name in block_writes(block)}
