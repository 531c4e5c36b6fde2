"""Unread: a Program without the values that nothing reads."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from language.operation import Assign, Block, Op
from language.program import Program
from language.traversal import block_reads, block_writes


def without_unread(program: Program, groups: tuple[str, ...]) -> Program:
    """Return a Program less those of its variables in some groups that neither it nor an output
    reads, as far as they are assigned outside of other operations.
    """
    shown = {wire.source for wire in program.outputs}
    lines = {name: [_line(op, groups) for op in b] for name, b in program.blocks.items()}
    while True:
        read = shown.union(*(line.reads for block in lines.values() for line in block))
        fewer = {name: [one for one in b if one.is_read(read)] for name, b in lines.items()}
        if fewer == lines:
            break
        lines = fewer
    blocks = {name: tuple(line.op for line in block) for name, block in lines.items()}
    gone = _written(program.blocks) - _written(blocks) - read
    variables = tuple(v for v in program.variables if v.name not in gone)
    return dataclasses.replace(program, blocks=blocks, variables=variables)


@dataclass(frozen=True)
class _Line:
    """An operation of a block with what it reads; `target` where it sets what may go."""

    op: Op
    reads: frozenset[str]
    target: str

    def is_read(self, read: set[str]) -> bool:
        """Tell whether it has to stay where so much is read."""
        return not self.target or self.target in read


def _line(op: Op, groups: tuple[str, ...]) -> _Line:
    target = op.target if isinstance(op, Assign) and op.target.startswith(groups) else ""
    return _Line(op, frozenset(block_reads((op,))), target)


def _written(blocks: Mapping[str, Block]) -> set[str]:
    return {name for block in blocks.values() for name in block_writes(block)}
