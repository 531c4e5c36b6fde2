"""Unread: a Program without the values that nothing reads."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from language.ir.ops import Assign, Block, Op
from language.ir.program import Program
from language.ir.traversal import block_reads, block_writes


def remove_dead_stores(program: Program, groups: tuple[str, ...]) -> Program:
    """Return a Program less those of its variables in some groups that neither it nor an output
    reads, as far as they are assigned outside of other operations.
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
    """An operation of a block with what it reads; `target` where it sets what may go."""

    op: Op
    reads: frozenset[str]
    target: str

    def is_live(self, read: set[str]) -> bool:
        """Tell whether it has to stay where so much is read."""
        return not self.target or self.target in read


def _op_reads(op: Op, groups: tuple[str, ...]) -> _OpReads:
    target = op.target if isinstance(op, Assign) and op.target.startswith(groups) else ""
    return _OpReads(op, frozenset(block_reads((op,))), target)


def _written_names(blocks: Mapping[str, Block]) -> set[str]:
    return {name for block in blocks.values() for name in block_writes(block)}
