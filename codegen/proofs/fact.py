"""Fact: what may hold of a Program's variables between two steps, or where a turn of a loop begins.

Facts are proposed from the text of the Program; what does not hold is taken out (`invariant.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from codegen.proofs.terms import Limits, Range
from codegen.statement import going_on
from language.charting import NOT_YET
from language.operation import (
    Assign,
    Block,
    Compare,
    Count,
    Expr,
    Loop,
    Ref,
    Run,
    Value,
    add,
    whole,
)
from language.program import MODE, Program, mode_variable
from language.run import MODE as RUN_MODE
from language.substitution import own_expressions, subexpressions
from language.traversal import block_writes, reached, walk

CARRIED = ("memory", "discrete", "timer", "state")
"""Groups of what is carried from step to step."""
LEFT = "memory.left_"
"""What a history holds: which mode was left, `NOT_YET` before that."""
MOST_FACTOR = 8
LARGEST_LIMIT = 64


@dataclass(frozen=True)
class Within:
    """A variable is within limits; if `where` names another one and a number, where that has it."""

    name: str
    limits: Limits
    where: tuple[str, int] | None = None

    @property
    def names(self) -> frozenset[str]:
        """The variables of it."""
        return frozenset((self.name, *(self.where[:1] if self.where else ())))


@dataclass(frozen=True)
class AtMost:
    """A counter is no larger than `factor` times the sum of others, and `more`; one more where the
    loop has `ended`.
    """

    name: str
    others: tuple[str, ...]
    factor: int = 1
    more: int = 0
    going: Expr | None = None

    @property
    def names(self) -> frozenset[str]:
        """The variables of it."""
        return frozenset((self.name, *self.others))


@dataclass(frozen=True)
class Same:
    """A truth value is that of a comparison with a number."""

    name: str
    other: str
    comparison: Compare

    @property
    def names(self) -> frozenset[str]:
        """The variables of it."""
        return frozenset((self.name, self.other))


Fact = Within | AtMost | Same


def between_steps(program: Program, ranges: Mapping[str, Range]) -> Iterator[Fact]:
    """Yield what may hold between two steps; `ranges` are those of variables."""
    kinds = {v.name: v.type for v in program.variables}
    yield from (Within(name, limits) for name, limits in ranges.items())
    numbers = _modes(program)
    yield from (Within(name, frozenset(of)) for name, of in numbers.items())
    yield from _counts(program)
    carried = [name for name in kinds if name.partition(".")[0] in CARRIED]
    truths = [name for name in carried if kinds[name] == "truth"]
    for mode, of in numbers.items():
        for number in of:
            for name in truths:
                yield from (Within(name, frozenset({k}), (mode, number)) for k in (0, 1))
    left = [name for name in carried if name.startswith(LEFT)]
    for one in left:
        yield from (Within(n, frozenset({NOT_YET}), (one, NOT_YET)) for n in left if n != one)


def in_loop(program: Program, loop: Loop) -> Iterator[Fact]:
    """Yield what may hold where a turn of a loop begins."""
    blocks = [loop.body, *(program.blocks[name] for name in runs_of(program, loop.body))]
    written = {name for block in blocks for name in block_writes(block)}
    yield from (fact for fact in between_steps(program, {}) if fact.names & written)
    ops = [op for block in blocks for op in walk(block)]
    counters = sorted({op.target for op in ops if isinstance(op, Assign) and _counts_up(op)})
    for op in ops:
        for expr in own_expressions(op):
            for part in subexpressions(expr):
                match part:
                    case Compare(_, Ref(name, True), Value(int(limit))) if (
                        name in counters and 0 < limit <= LARGEST_LIMIT
                    ):
                        yield Within(name, frozenset(range(limit + 1)))
        match op:
            case Assign(target, Compare(_, Ref(name, True), Value()) as comparison):
                yield Same(target, name, comparison)
    going = going_on(loop.index, loop.body)[0]
    for one in counters:
        others = [name for name in counters if name != one]
        for other in others:
            factors = range(1, MOST_FACTOR + 1)
            yield from (AtMost(one, (other,), k, more) for k in factors for more in (0, 1))
            if one < other:
                yield AtMost(loop.index, (one, other), going=going)
        yield AtMost(loop.index, (one,), going=going)


def _counts_up(op: Assign) -> bool:
    return op.value == add(Ref(op.target, True), whole(1))


def _counts(program: Program) -> Iterator[Fact]:
    for block in program.blocks.values():
        for op in walk(block):
            if isinstance(op, Count):
                yield Within(op.timer, frozenset(range(op.limit)))
                yield Within(op.timer, frozenset(range(op.limit + 1)))


def _modes(program: Program) -> dict[str, list[int]]:
    """Return the numbers of modes by the variable that holds one."""
    modes = {MODE: program.modes, RUN_MODE: program.run_modes}
    modes |= {mode_variable(MODE, region.name): region.modes for region in program.regions}
    known = {v.name for v in program.variables}
    return {
        name: [info.number for info in of] for name, of in modes.items() if of and name in known
    }


def runs_of(program: Program, block: Block) -> set[str]:
    """Return the names of the blocks that a block runs, and those run."""
    called = [op.block for op in walk(block) if isinstance(op, Run)]
    return {run for name in called for run in reached(name, program.blocks)}
