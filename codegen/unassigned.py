"""Unassigned: what a tick or step may read of its work values before it has set them.

Only these are set when X_Step begins; all others are set on every way to where they are read.
"""

from __future__ import annotations

from collections.abc import Iterator

from language.operation import (
    Assign,
    Block,
    Branch,
    Choose,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    Run,
    Store,
    Value,
)
from language.program import Program
from language.substitution import own_expressions, subexpressions

WORK = "work."
Set = frozenset[str]


def unassigned(program: Program, entry: str, shared: frozenset[str]) -> frozenset[str]:
    """Return the shared work variables that an entry may read before it sets them."""
    way = _Way(program, shared)
    way.run(program.blocks[entry], frozenset())
    return frozenset(way.found)


class _Way:
    """A way through the blocks of a Program, with what is set on every branch of it."""

    def __init__(self, program: Program, shared: frozenset[str]) -> None:
        self.program = program
        self.shared = shared
        self.sizes = {v.name: v.size for v in program.variables if v.size}
        self.known: dict[tuple[str, Set], Set] = {}
        self.found: set[str] = set()

    def run(self, block: Block, done: Set) -> Set:
        """Return what is set behind a block, of which `done` is set before it."""
        for op in block:
            for expr in own_expressions(op):
                self._read(expr, done)
            done = self._behind(op, done)
        return done

    def _behind(self, op: Op, done: Set) -> Set:
        match op:
            case Assign(target, _, _):
                return done | {target}
            case Store(array, Value(index), _):
                return done | {f"{array}[{index}]"}
            case Branch(_, then, other):
                return self.run(then, done) & self.run(other, done)
            case Choose(selector, cases):
                self._read(Ref(selector), done)
                for _, case in cases:
                    self.run(case, done)  # none of them may be taken
                return done
            case Loop(count, index, body) if count:
                return self.run(body, done | {index})
            case Run(name):
                if (name, done) not in self.known:
                    self.known[name, done] = self.run(self.program.blocks[name], done)
                return self.known[name, done]
            case _:
                return done

    def _read(self, expr: Expr, done: Set) -> None:
        for part in subexpressions(expr):
            if isinstance(part, Ref) and part.name in self.shared - done:
                self.found.add(part.name)
            if isinstance(part, Item) and part.name in self.shared:
                elements = set(_elements(part, self.sizes[part.name]))
                self.found.update({part.name} if elements - done else ())


def _elements(item: Item, size: int) -> Iterator[str]:
    match item.index:
        case Value(index):
            yield f"{item.name}[{index}]"
        case _:
            yield from (f"{item.name}[{k}]" for k in range(size))
