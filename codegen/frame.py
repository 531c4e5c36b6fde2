"""Frame: which functions of C have a frame of their own on the stack, while they run only.

Where an ECU computes in software, what a function computes is on its stack. A compiler puts
functions that are called once into each other, and the frame of all is open while any of them runs.
"""

from __future__ import annotations

from collections import defaultdict

from language.operation import Binary, Run
from language.program import Program
from language.substitution import own_expressions, subexpressions
from language.traversal import walk

ARITHMETIC = ("+", "-", "*", "/")
LEAST = 3
"""Operations from which on a call is little beside what is computed in software."""


def apart(program: Program) -> frozenset[str]:
    """Return the blocks that compute much; not those that one of these alone runs, once.

    Of a sampled automaton in float64: float32 is in registers.
    """
    if program.period is None or program.number == "float32":
        return frozenset()
    callers: dict[str, list[str]] = defaultdict(list)
    for name, block in program.blocks.items():
        for op in walk(block):
            if isinstance(op, Run):
                callers[op.block].append(name)
    much = frozenset(name for name in program.blocks if _operations(program, name) >= LEAST)
    return frozenset(n for n in much if len(callers[n]) != 1 or callers[n][0] not in much)


def _operations(program: Program, name: str) -> int:
    return sum(
        isinstance(part, Binary) and part.operator in ARITHMETIC
        for op in walk(program.blocks[name])
        for whole in own_expressions(op)
        for part in subexpressions(whole)
    )
