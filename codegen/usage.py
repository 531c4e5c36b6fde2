"""Usage: what each block of a Program reads and writes, directly and through the blocks it runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from codegen.unassigned import unassigned
from language.operation import (
    Assign,
    Block,
    Branch,
    Choose,
    Loop,
    Run,
)
from language.program import Program
from language.stepping import BETWEEN
from language.traversal import block_reads, block_writes, reached, walk

GROUP_OF = {
    "input": "in",
    "is_new": "in",
    "work": "work",
    "state": "self",
    "discrete": "self",
    "latched": "self",
    "equation": "self",
    "before": "self",
    "innovation": "self",
    "check": "self",
    "timer": "self",
    "memory": "self",
    "derived": "self",
}
ON_PAGE = frozenset({"calibration"})
ORDER = ("self", "cal", "in", "work")


@dataclass(frozen=True)
class Usage:
    """The pointers that a block needs, and those through which it writes."""

    needs: frozenset[str]
    writes: frozenset[str]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The pointers in the order in which functions take them."""
        return tuple(name for name in ORDER if name in self.needs)


def usages(
    program: Program, local: Mapping[str, frozenset[str]], on_page: frozenset[str] = ON_PAGE
) -> dict[str, Usage]:
    """Return the usage of every block; `local` are the variables that live inside a block,
    `on_page` the groups of constants that the calibration page has.
    """
    groups = {**GROUP_OF, **dict.fromkeys(on_page, "cal")}
    found: dict[str, Usage] = {}

    def visit(name: str) -> Usage:
        if name not in found:
            read = {n for n in block_reads(program.blocks[name]) if n not in local[name]}
            written = {n for n in block_writes(program.blocks[name]) if n not in local[name]}
            needs = {groups.get(n.partition(".")[0], "") for n in read | written} - {""}
            writes = {groups.get(n.partition(".")[0], "") for n in written} - {""}
            for op in walk(program.blocks[name]):
                if isinstance(op, Run):
                    inner = visit(op.block)
                    needs |= inner.needs
                    writes |= inner.writes
            found[name] = Usage(frozenset(needs), frozenset(writes))
        return found[name]

    for name in program.blocks:
        visit(name)
    return found


def locals_of(
    program: Program, turned: Mapping[str, frozenset[str]] | None = None
) -> dict[str, frozenset[str]]:
    """Return, per block, the work variables that live inside it: set once, then read there, or
    those that have `turned` (see `turning`).

    A variable that some block reads without having set it is shared by the blocks.
    """
    once = {name: _set_once(block) for name, block in program.blocks.items()}
    shared = {variable.name for variable in program.variables if variable.size}
    for name, block in program.blocks.items():
        used = {n for n in (*block_reads(block), *block_writes(block)) if n.startswith("work.")}
        shared |= used - once[name]
    found, turned = {}, turning(program) if turned is None else turned
    for name, block in program.blocks.items():
        loops = {op.index for op in walk(block) if isinstance(op, Loop)}
        found[name] = frozenset((once[name] - shared) | loops | turned[name])
    return found


def turning(program: Program) -> dict[str, frozenset[str]]:
    """Return, per block, the work variables that live inside it, and that its loops set.

    Every block that has one sets it before it reads it, and runs none that has it too.
    """
    loops = [op for block in program.blocks.values() for op in walk(block) if isinstance(op, Loop)]
    known = {n for op in loops for n in block_writes(op.body) if n.startswith("work.")}
    known -= {*BETWEEN, *(op.index for op in loops), *(v.name for v in program.variables if v.size)}
    if not known:
        return dict.fromkeys(program.blocks, frozenset())
    has = {
        name: (known & set(block_reads(block)), known & set(block_writes(block)))
        for name, block in program.blocks.items()
    }
    for name, (read, written) in has.items():
        known -= read ^ written
        below = reached(name, program.blocks) - {name}
        known -= read & {n for other in below for names in has[other] for n in names}
        known -= unassigned(program, name, frozenset(read & known)) if read & known else set()
    return {name: frozenset(read & known) for name, (read, _) in has.items()}


def _set_once(block: Block) -> set[str]:
    """Work variables assigned exactly once, and read only in the same list of operations."""
    counts = Counter(op.target for op in walk(block) if isinstance(op, Assign))
    outside = Counter(block_reads(block))
    found: set[str] = set()
    for ops in _lists(block):
        inside: Counter[str] = Counter()
        assigned: set[str] = set()
        for op in ops:
            fresh = Counter(block_reads((op,)))
            inside.update(fresh)
            if isinstance(op, Assign) and counts[op.target] == 1 and not inside[op.target]:
                assigned.add(op.target)
        found |= {n for n in assigned if n.startswith("work.") and 0 < inside[n] == outside[n]}
    return found


def _lists(block: Block) -> Iterator[Block]:
    yield block
    for op in block:
        match op:
            case Branch(_, then, other):
                yield from _lists(then)
                yield from _lists(other)
            case Choose(_, cases):
                for _, case_block in cases:
                    yield from _lists(case_block)
            case Loop(_, _, body):
                yield from _lists(body)
            case _:
                pass
