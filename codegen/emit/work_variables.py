"""Work variables of a step: the block in whose function they live, and their storage (rule C22).

Usually the function is `step`. If only one block that `step` runs uses them, and runs once, such as
the run of a model by an observer, they live there. A step that does not run that block then needs
no storage for them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.passes.block_usage import Usage
from language.ir.definite_assignment import find_unassigned_reads
from language.ir.ops import Loop
from language.ir.program import Program, Variable
from language.ir.traversal import called_blocks, names_used, reachable_blocks, walk_ops

STEP = "step"
"""The block that executes one step."""
MAX_STACK_BYTES = 128
"""Maximum size [bytes] of work variables on the stack; larger ones are a part of the instance."""


@dataclass(frozen=True)
class Scratch:
    """The storage of work variables: the `block` that owns them and their `size` [bytes].

    `initialised` holds the variables that are set to 0 when the block begins, because they may be
    read before they are assigned.
    """

    block: str
    size: int
    initialised: tuple[Variable, ...]

    @property
    def is_zeroed(self) -> bool:
        """Tell whether the whole structure is set to 0 when the block begins.

        This is the case if one of the `initialised` variables is an array.
        """
        return any(variable.size for variable in self.initialised)

    @property
    def is_in_instance(self) -> bool:
        """Tell whether the storage is a part of the instance: it is larger than MAX_STACK_BYTES."""
        return self.size > MAX_STACK_BYTES


def scratch_of(
    program: Program,
    shared: list[Variable],
    usage_by_block: Mapping[str, Usage],
    allow_inner_block: bool,
) -> Scratch | None:
    """Return the storage of the `shared` work variables of a step (rule C22).

    Returns None if there are none, or no block `step`. The owner is `step`; with
    `allow_inner_block` it is the innermost block that contains all uses and is run once, without a
    loop around it. The size counts 8 bytes (float32: 4) for each scalar or array element, of any
    type.
    """
    if not shared or STEP not in program.blocks:
        return None
    known = frozenset(variable.name for variable in shared)
    block = _innermost_block(program, known, usage_by_block) if allow_inner_block else STEP
    each = 8 if program.number_type == "float64" else 4
    size = sum(each * max(1, variable.size) for variable in shared)
    # Compilers warn of variables on the stack, and they do not know which modes there are.
    names = find_unassigned_reads(program, block, known, are_modes_known=size > MAX_STACK_BYTES)
    return Scratch(block, size, tuple(v for v in shared if v.name in names))


def _innermost_block(
    program: Program, shared: frozenset[str], usage_by_block: Mapping[str, Usage]
) -> str:
    """Return the innermost block from `step` down that contains all uses of the shared variables.

    The search goes down while a block uses none of them itself, has no loop, and runs exactly one
    block that needs them.
    """
    name = STEP
    while True:
        block = program.blocks[name]
        is_plain = not shared & names_used([block]) and not any(
            isinstance(op, Loop) for op in walk_ops(block)
        )
        callers = [
            called for called in called_blocks(block) if "work" in usage_by_block[called].needs
        ]
        if not is_plain or len(callers) != 1:
            return name
        name = callers[0]


def adjust_usages(
    program: Program, usage_by_block: Mapping[str, Usage], scratch: Scratch
) -> dict[str, Usage]:
    """Return the usages of blocks for an owner other than `step`.

    The blocks that reach the owner, and the owner itself, no longer need the pointer `work`; they
    need and write `self` if the variables are a part of the instance. Other blocks are unchanged.
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
