"""Checks of assignment: on some path a work variable is assigned before each of its reads.

A forward analysis follows each entry through all blocks that it runs. After a branch it holds what
either arm assigns, and at the beginning of a loop what its body assigns. So a read that fails has
no path on which its variable has a value of this step. Reads for which only some paths have one are
those of `find_unassigned_reads`; C sets these to 0.
"""

from __future__ import annotations

from collections.abc import Iterator

from language.ir.ops import Assign, Block, Branch, Count, Loop, Op, RunBlock, Store, Switch
from language.ir.program import STEP_INTERFACE, Program
from language.ir.rewrite_ops import direct_expressions
from language.ir.traversal import block_reads, block_writes, expr_names, reachable_blocks
from language.ircheck.violation import Violation, operation_place

NameSet = frozenset[str]
COMPLETE_ENTRIES = ("init", "compare_stamps", "step", "invariants")
"""Entries that get no work variables from blocks that ran before them."""
DERIVE = "derive"
"""The entry that assigns all derived constants anew."""
DENSE_TIME = "work.s"
"""The time after the start of a flow at which the engine evaluates the dense output."""
INPUT_PREFIXES = ("work.rise_", "work.bend_")
"""Prefixes of the coefficients of inputs that vary inside a step, which the engine assigns."""
WORK, DERIVED = "work.", "derived."


def check_assignment(program: Program) -> Iterator[Violation]:
    """Yield a violation for each read of a work variable that no path has assigned before.

    The engine runs other blocks of a continuous Program after one another. Of these only variables
    that no block assigns, and that are not of STEP_INTERFACE, are reported. All blocks that an
    operation runs must exist.
    """
    analysis = _AssignmentAnalysis(program)
    for entry in COMPLETE_ENTRIES:
        if entry in program.blocks:
            analysis.follow_entry(entry, (WORK,))
    if DERIVE in program.blocks:
        analysis.follow_entry(DERIVE, (WORK, DERIVED))
    yield from analysis.violations
    found = {violation.message for violation in analysis.violations}
    written = {name for block in program.blocks.values() for name in block_writes(block)}
    for name, block in program.blocks.items():
        for read in dict.fromkeys(block_reads(block)):
            if read.startswith(WORK) and read not in written and not _is_set_by_engine(read):
                message = _message(read)
                if message not in found:
                    yield Violation("assignment", f"block {name}", message)


def _is_set_by_engine(name: str) -> bool:
    """Return whether an engine assigns a work variable before it runs blocks of a step."""
    return name in STEP_INTERFACE or name == DENSE_TIME or name.startswith(INPUT_PREFIXES)


class _AssignmentAnalysis:
    """The names that are assigned on some path to an operation; see the module.

    A block is analysed once for each set of names with which it is run.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        self.groups: tuple[str, ...] = ()
        self.violations: dict[Violation, None] = {}
        self.ends: dict[tuple[str, NameSet], NameSet] = {}

    def follow_entry(self, name: str, groups: tuple[str, ...]) -> None:
        """Follow a block that is run from outside; names of `groups` are unassigned before it."""
        self.groups, self.ends = groups, {}
        self._follow_named(name, frozenset())

    def _follow_named(self, name: str, assigned: NameSet) -> NameSet:
        """Return the names that are assigned after a named block."""
        key = name, assigned
        if key not in self.ends:
            self.ends[key] = self._follow(name, self.program.blocks[name], assigned)
        return self.ends[key]

    def _follow(self, name: str, block: Block, assigned: NameSet) -> NameSet:
        """Return the names that are assigned after a block, given those assigned before it."""
        for op in block:
            reads = [read for expr in direct_expressions(op) for read in expr_names(expr)]
            if isinstance(op, Switch):
                reads.append(op.selector)
            for read in reads:
                if read.startswith(self.groups) and read not in assigned:
                    place = operation_place(name, op)
                    self.violations[Violation("assignment", place, _message(read))] = None
            assigned = self._follow_op(name, op, assigned)
        return assigned

    def _written_by(self, body: Block) -> NameSet:
        """Return the names that a turn of a loop may assign, for the turns after it."""
        blocks = {**self.program.blocks, "": body}
        reached = reachable_blocks("", blocks)
        return frozenset(name for inner in reached for name in block_writes(blocks[inner]))

    def _follow_op(self, name: str, op: Op, assigned: NameSet) -> NameSet:
        """Return the names that are assigned after an operation."""
        match op:
            case Assign(target) | Store(target) | Count(target):
                return assigned | {target} if target.startswith(self.groups) else assigned
            case Branch(_, then, other):
                return self._follow(name, then, assigned) | self._follow(name, other, assigned)
            case Switch(_, cases):
                ends = [self._follow(name, block, assigned) for _, block in cases]
                return assigned.union(*ends)
            case Loop(count, index, body):
                earlier = self._written_by(body) if count > 1 else frozenset[str]()
                return self._follow(name, body, assigned | earlier | {index})
            case RunBlock(called):
                return self._follow_named(called, assigned)
        return assigned


def _message(name: str) -> str:
    """Return the message of a read that no assignment precedes."""
    return f"`{name}` is read, but no path assigns it before"
