"""Frame: which functions of C have a frame of their own on the stack, while they run only.

Where an ECU computes in software, what a function computes is on its stack. A compiler puts
functions that are called once into each other, and the frame of all is open while any of them runs.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from language.ir.ops import Binary, Block, Expr, Item, Loop, Ref, RunBlock, Value
from language.ir.program import Program
from language.ir.rewrite_ops import direct_expressions, walk_post_order
from language.ir.traversal import walk_ops

ARITHMETIC = ("+", "-", "*", "/")
MIN_OPERATIONS = 3
"""Operations from which on a call is little beside what is computed in software."""
ALWAYS_NOINLINE = ("hold", "rows_", "columns_")
"""Blocks that are apart in any number type: a covariance is more than there are registers."""

NOINLINE_BESIDE = frozenset({"latch"})
"""Blocks that are apart where one of those is: what holds the inputs compares in software, too; put
into the step itself, what it saves of registers would lie below a covariance (decision 0026)."""


def select_noinline_blocks(program: Program) -> frozenset[str]:
    """Return the blocks of a sampled automaton that compute much; not those that one of these
    alone runs, once. In float32 nearly all is in registers (rule C23).
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
        expensive |= NOINLINE_BESIDE & program.blocks.keys()
    return frozenset(n for n in expensive if len(callers[n]) != 1 or callers[n][0] not in expensive)


def _call_sites(block: Block) -> Iterator[str]:
    """Yield the blocks that a block runs: twice what its loops run."""
    for op in walk_ops(block):
        if isinstance(op, RunBlock):
            yield op.block
        if isinstance(op, Loop):
            yield from (inner.block for inner in walk_ops(op.body) if isinstance(inner, RunBlock))


def _count_float_operations(program: Program, name: str) -> int:
    return sum(
        isinstance(part, Binary) and part.operator in ARITHMETIC and not _is_integer(part)
        for op in walk_ops(program.blocks[name])
        for expr in direct_expressions(op)
        for part in walk_post_order(expr)
    )


def _is_integer(expr: Expr) -> bool:
    match expr:
        case Binary(_, left, right):
            return _is_integer(left) or _is_integer(right)
        case Value(value):
            return isinstance(value, int)
        case Ref(_, whole) | Item(_, _, whole):
            return whole
    return False
