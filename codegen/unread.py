"""Unread: a Program without the values that nothing reads."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping

from language.operation import Assign, Block
from language.program import Program
from language.traversal import block_reads, block_writes


def without_unread(program: Program, groups: tuple[str, ...]) -> Program:
    """Return a Program less those of its variables in some groups that neither it nor an output
    reads, as far as they are assigned outside of other operations.
    """
    blocks = dict(program.blocks)
    shown = {wire.source for wire in program.outputs}
    while True:
        read = shown.union(*(block_reads(block) for block in blocks.values()))
        fewer = {name: _without(block, groups, read) for name, block in blocks.items()}
        if fewer == blocks:
            break
        blocks = fewer
    gone = _written(program.blocks) - _written(blocks) - read
    variables = tuple(v for v in program.variables if v.name not in gone)
    return dataclasses.replace(program, blocks=blocks, variables=variables)


def _written(blocks: Mapping[str, Block]) -> set[str]:
    return {name for block in blocks.values() for name in block_writes(block)}


def _without(block: Block, groups: tuple[str, ...], read: Collection[str]) -> Block:
    return tuple(
        op
        for op in block
        if not (isinstance(op, Assign) and op.target.startswith(groups) and op.target not in read)
    )
