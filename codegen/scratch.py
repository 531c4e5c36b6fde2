"""Scratch: the block of a module in which the values live that are there within one step only.

That is `step`, unless all of them are for one block that it runs, once, on some ways only: an
observer's run of a model. Then the steps that do not take that way have no part in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.unassigned import unassigned
from codegen.usage import Usage
from language.operation import Loop, Run
from language.program import Program, Variable
from language.traversal import reached, reads, walk

STEP = "step"
MOST_ON_STACK = 128
"""Bytes; more is kept in the instance, whose place the caller knows."""


@dataclass(frozen=True)
class Scratch:
    """The block that has it, its size [bytes], and which of its values are set `early`: when it
    begins.
    """

    block: str
    size: int
    early: tuple[Variable, ...]

    @property
    def is_cleared(self) -> bool:
        """Tell whether all of it is 0 when the block begins: there are arrays among the early."""
        return any(variable.size for variable in self.early)

    @property
    def is_in_instance(self) -> bool:
        """Tell whether it is a part of the instance, not of the stack."""
        return self.size > MOST_ON_STACK


def scratch_of(
    program: Program, shared: list[Variable], used: Mapping[str, Usage], inside: bool
) -> Scratch | None:
    """Return where the `shared` values of a step live; None where there are none (rule C22).

    `inside` allows for a block that `step` runs.
    """
    if not shared or STEP not in program.blocks:
        return None
    known = frozenset(variable.name for variable in shared)
    block = _only(program, known, used) if inside else STEP
    names = unassigned(program, block, known)
    each = 8 if program.number == "float64" else 4
    size = sum(each * max(1, variable.size) for variable in shared)
    return Scratch(block, size, tuple(v for v in shared if v.name in names))


def _only(program: Program, shared: frozenset[str], used: Mapping[str, Usage]) -> str:
    """Return the innermost block that `step` runs, once, and that has all of the values."""
    name = STEP
    while True:
        block = program.blocks[name]
        is_plain = not shared & reads([block]) and not any(
            isinstance(op, Loop) for op in walk(block)
        )
        runs = [op.block for op in walk(block) if isinstance(op, Run)]
        callers = [called for called in runs if "work" in used[called].needs]
        if not is_plain or len(callers) != 1:
            return name
        name = callers[0]


def with_own(program: Program, used: Mapping[str, Usage], scratch: Scratch) -> dict[str, Usage]:
    """Return what blocks need from outside, where one has the values of a step itself: of all else
    the instance, if they are a part of that.
    """
    mine = frozenset({"self"} if scratch.is_in_instance else ())
    found = dict(used)
    above = {name for name in program.blocks if scratch.block in reached(name, program.blocks)}
    for name in above:
        one = used[name]
        found[name] = Usage((one.needs - {"work"}) | mine, (one.writes - {"work"}) | mine)
    return found
