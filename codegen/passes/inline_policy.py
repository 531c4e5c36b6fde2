"""Inline policy: the pass that marks the blocks that are not inlined in C (rule C23).

before                      after
block latch_each            block latch_each (rarely)
block rates_gap             block rates_gap (not-inlined)
block jump_gap              block jump_gap

Where an ECU computes in software, the intermediate values of a function are on the stack. A
compiler inlines functions that are called once, and the frame of the merged function is allocated
as long as any part of it runs.
"""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Iterator

from codegen.passes.fast_path import EVENT_PATH
from codegen.passes.range_check_merging import LATCH_EACH
from language.ir.expression_type import is_whole
from language.ir.ops import Binary, Block, Loop, RunBlock
from language.ir.program import InlineMark, Program
from language.ir.rewrite_ops import direct_expressions, walk_post_order
from language.ir.traversal import called_blocks, walk_ops

ARITHMETIC = ("+", "-", "*", "/")
"""Operators whose floating-point operations are counted."""
MIN_OPERATIONS = 3
"""Number of floating-point operations from which on a call costs little in comparison."""
ALWAYS_NOINLINE = ("saturate_states", "rows_", "columns_")
"""Prefixes of blocks that are never inlined, in any number type: a covariance does not fit into
registers."""

NOINLINE_WITH_COVARIANCE = frozenset({"latch"})
"""Blocks that are not inlined if one of ALWAYS_NOINLINE exists. The comparison of inputs with their
ranges is computed in software too. Inlined into the step, its saved registers would add to the
stack below a covariance (decision 0026)."""


COLD_BLOCKS = (LATCH_EACH, EVENT_PATH, "rollback_")
"""Prefixes of blocks that run rarely and are not inlined."""


def mark_inlining(program: Program) -> Program:
    """Return a Program whose blocks that are not inlined are marked in `inlining` (rule C23).

    The mark is `rarely` for blocks of COLD_BLOCKS, and `not-inlined` for those that
    `select_noinline_blocks` returns.
    """
    marks: dict[str, InlineMark] = {}
    noinline = select_noinline_blocks(program)
    for name in program.blocks:
        if name.startswith(COLD_BLOCKS):
            marks[name] = "rarely"
        elif name in noinline:
            marks[name] = "not-inlined"
    return dataclasses.replace(program, inlining=marks)


def select_noinline_blocks(program: Program) -> frozenset[str]:
    """Return the names of the blocks whose functions are not inlined (rule C23).

    A continuous automaton has none; in float32 only blocks of ALWAYS_NOINLINE are returned. In
    float64 also blocks with at least MIN_OPERATIONS floating-point operations and, if one of
    ALWAYS_NOINLINE exists, those of NOINLINE_WITH_COVARIANCE. Of all these, one is left out if it
    has exactly one call site, in another of them; a call in a loop counts as more than one.
    """
    if program.period is None:
        return frozenset()
    always = frozenset(name for name in program.blocks if name.startswith(ALWAYS_NOINLINE))
    if program.number_type == "float32":
        return always
    callers: dict[str, list[str]] = defaultdict(list)
    for name, block in program.blocks.items():
        for called in _call_sites(block):
            callers[called].append(name)
    expensive = frozenset(
        name for name in program.blocks if _count_float_operations(program, name) >= MIN_OPERATIONS
    )
    expensive |= always
    if always:
        expensive |= NOINLINE_WITH_COVARIANCE & program.blocks.keys()
    return frozenset(n for n in expensive if len(callers[n]) != 1 or callers[n][0] not in expensive)


def _call_sites(block: Block) -> Iterator[str]:
    """Yield the name of each block that a block runs; a call inside a loop counts twice."""
    for op in walk_ops(block):
        if isinstance(op, RunBlock):
            yield op.block
        if isinstance(op, Loop):
            yield from called_blocks(op.body)


def _count_float_operations(program: Program, name: str) -> int:
    """Return the number of floating-point operations of a block, without those it runs."""
    return sum(
        isinstance(part, Binary) and part.operator in ARITHMETIC and not is_whole(part)
        for op in walk_ops(program.blocks[name])
        for expr in direct_expressions(op)
        for part in walk_post_order(expr)
    )
