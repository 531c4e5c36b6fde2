"""Scratch: the block of a module in which the values live that are there within one step only.

That is `step`, unless all of them are for one block that it runs, once, on some ways only: an
observer's run of a model. Then the steps that do not take that way have no part in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.passes.block_usage import Usage
from codegen.passes.definite_assignment import find_unassigned_reads
from language.ir.ops import Loop, RunBlock
from language.ir.program import Program, Variable
from language.ir.traversal import names_used, reachable_blocks, walk_ops

STEP = "step"
MAX_STACK_BYTES = 128
"""Bytes; more is kept in the instance, whose place the caller knows."""


@dataclass(frozen=True)
class Scratch:
    """The block that has it, its size [bytes], and which of its values are set `early`: when it
    begins.
    """

    block: str
    size: int
    initialised: tuple[Variable, ...]

    @property
    def is_zeroed(self) -> bool:
        """Tell whether all of it is 0 when the block begins: there are arrays among the early."""
        return any(variable.size for variable in self.initialised)

    @property
    def is_in_instance(self) -> bool:
        """Tell whether it is a part of the instance, not of the stack."""
        return self.size > MAX_STACK_BYTES


def scratch_of(
    program: Program,
    shared: list[Variable],
    usage_by_block: Mapping[str, Usage],
    allow_inner_block: bool,
) -> Scratch | None:
    """Return where the `shared` values of a step live; None where there are none (rule C22).

    `allow_inner_block` allows for a block that `step` runs.
    """
    if not shared or STEP not in program.blocks:
        return None
    known = frozenset(variable.name for variable in shared)
    block = _innermost_block(program, known, usage_by_block) if allow_inner_block else STEP
    names = find_unassigned_reads(program, block, known)
    each = 8 if program.number_type == "float64" else 4
    size = sum(each * max(1, variable.size) for variable in shared)
    return Scratch(block, size, tuple(v for v in shared if v.name in names))


def _innermost_block(
    program: Program, shared: frozenset[str], usage_by_block: Mapping[str, Usage]
) -> str:
    """Return the innermost block that `step` runs, once, and that has all of the values."""
    name = STEP
    while True:
        block = program.blocks[name]
        is_plain = not shared & names_used([block]) and not any(
            isinstance(op, Loop) for op in walk_ops(block)
        )
        runs = [op.block for op in walk_ops(block) if isinstance(op, RunBlock)]
        callers = [called for called in runs if "work" in usage_by_block[called].needs]
        if not is_plain or len(callers) != 1:
            return name
        name = callers[0]


def adjust_usages(
    program: Program, usage_by_block: Mapping[str, Usage], scratch: Scratch
) -> dict[str, Usage]:
    """Return what blocks need from outside, where one has the values of a step itself: of all else
    the instance, if they are a part of that.
    """
    instance = frozenset({"self"} if scratch.is_in_instance else ())
    adjusted = dict(usage_by_block)
    callers = {
        name for name in program.blocks if scratch.block in reachable_blocks(name, program.blocks)
    }
    for name in callers:
        one = usage_by_block[name]
        adjusted[name] = Usage(
            (one.needs - {"work"}) | instance, (one.writes - {"work"}) | instance
        )
    return adjusted
