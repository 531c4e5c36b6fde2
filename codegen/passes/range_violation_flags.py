"""Range violation flags: a pass that records which signals left their range, for simulations.

before                      after
fault range_a of a          fault range_a of a
                            memory.left_0 := True
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from language.ir.ops import Assign, FaultBit, Op, Value
from language.ir.program import Program, Variable
from language.ir.rewrite_ops import map_operations
from language.ir.traversal import walk_ops

RANGE_VIOLATION_FLAG = "memory.left_{}"
"""The name of the flag of a signal; `{}` is the index in `ranged_signals`."""


def ranged_signals(program: Program) -> tuple[str, ...]:
    """Return the signals that some operation sets a fault bit for, each once, in program order.

    Fault bits without a signal are left out; the result may be empty.
    """
    ops = (op for block in program.blocks.values() for op in walk_ops(block))
    found = (op.signal for op in ops if isinstance(op, FaultBit) and op.value)
    return tuple(dict.fromkeys(signal for signal in found if signal))


def add_range_violation_flags(program: Program) -> Program:
    """Return a Program with a truth variable for each of its `ranged_signals`.

    The variable `memory.left_<index>` is set to true after each operation that sets a fault bit of
    that signal; nothing clears it. A Program without such signals is returned unchanged.
    """
    signals = ranged_signals(program)
    if not signals:
        return program
    marks = {signal: RANGE_VIOLATION_FLAG.format(k) for k, signal in enumerate(signals)}
    variables = (*program.variables, *(Variable(name, "truth") for name in marks.values()))

    def insert_mark(op: Op) -> Iterator[Op]:
        """Yield an operation, and the assignment of its flag if it sets the bit of a signal."""
        yield op
        if isinstance(op, FaultBit) and op.signal and op.value:
            yield Assign(marks[op.signal], Value(True))

    blocks = {name: map_operations(block, insert_mark) for name, block in program.blocks.items()}
    return dataclasses.replace(program, variables=variables, blocks=blocks)
