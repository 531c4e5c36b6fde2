"""Frame: which functions of C have a frame of their own on the stack, while they run only.

Where an ECU computes in software, what a function computes is on its stack. A compiler puts
functions that are called once into each other, and the frame of all is open while any of them runs.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from language.operation import Binary, Block, Expr, Item, Loop, Ref, Run, Value
from language.program import Program
from language.substitution import own_expressions, subexpressions
from language.traversal import walk

ARITHMETIC = ("+", "-", "*", "/")
LEAST = 3
"""Operations from which on a call is little beside what is computed in software."""
ALWAYS = ("hold", "rows_", "columns_")
"""Blocks that are apart in any number type: a covariance is more than there are registers."""

BESIDE = frozenset({"latch"})
"""Blocks that are apart where one of those is: what holds the inputs compares in software, too; put
into the step itself, what it saves of registers would lie below a covariance (decision 0026)."""


def apart(program: Program) -> frozenset[str]:
    """Return the blocks of a sampled automaton that compute much; not those that one of these
    alone runs, once. In float32 nearly all is in registers (rule C23).
    """
    if program.period is None:
        return frozenset()
    always = frozenset(name for name in program.blocks if name.startswith(ALWAYS))
    if program.number == "float32":
        return always
    callers: dict[str, list[str]] = defaultdict(list)
    for name, block in program.blocks.items():
        for called in _runs(block):
            callers[called].append(name)
    much = frozenset(name for name in program.blocks if _operations(program, name) >= LEAST)
    much |= always
    if always:
        much |= BESIDE & program.blocks.keys()
    return frozenset(n for n in much if len(callers[n]) != 1 or callers[n][0] not in much)


def _runs(block: Block) -> Iterator[str]:
    """Yield the blocks that a block runs: twice what its loops run."""
    for op in walk(block):
        if isinstance(op, Run):
            yield op.block
        if isinstance(op, Loop):
            yield from (inner.block for inner in walk(op.body) if isinstance(inner, Run))


def _operations(program: Program, name: str) -> int:
    return sum(
        isinstance(part, Binary) and part.operator in ARITHMETIC and not _is_whole(part)
        for op in walk(program.blocks[name])
        for whole in own_expressions(op)
        for part in subexpressions(whole)
    )


def _is_whole(expr: Expr) -> bool:
    match expr:
        case Binary(_, left, right):
            return _is_whole(left) or _is_whole(right)
        case Value(value):
            return isinstance(value, int)
        case Ref(_, whole) | Item(_, _, whole):
            return whole
    return False
