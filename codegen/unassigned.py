"""Unassigned: what a tick or step may read of its work values before it has set them.

Only these are set when X_Step begins; all others are set on every way to where they are read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from language.operation import (
    Assign,
    Binary,
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
from language.program import MODE, Program
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
        self.modes = {mode.number for mode in program.modes}
        self.known: dict[tuple[str, Set, frozenset[tuple[str, int]]], Set] = {}
        self.turn: dict[str, int] = {}
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
            case Store(array, index, _):
                place = _number(index, self.turn)
                return done if place is None else done | {f"{array}[{place}]"}
            case Branch(_, then, other):
                return self.run(then, done) & self.run(other, done)
            case Choose(selector, cases):
                self._read(Ref(selector), done)
                ends = [self.run(case, done) for _, case in cases]
                every = self.modes if selector == MODE else set()
                if every and {number for number, _ in cases} >= every:
                    return frozenset.intersection(*ends)
                return done  # none of them may be taken
            case Loop(count, index, body) if count:
                return self._loop(count, index, body, done | {index})
            case Run(name):
                key = name, done, frozenset(self.turn.items())
                if key not in self.known:
                    self.known[key] = self.run(self.program.blocks[name], done)
                return self.known[key]
            case _:
                return done

    def _loop(self, count: int, index: str, body: Block, done: Set) -> Set:
        """Follow each turn of a loop that fills arrays, and the first of any other."""
        if not any(isinstance(op, Store) for op in body):
            return self.run(body, done)
        for turn in range(count):
            self.turn[index] = turn
            done = self.run(body, done)
        del self.turn[index]
        return done

    def _read(self, expr: Expr, done: Set) -> None:
        for part in subexpressions(expr):
            if isinstance(part, Ref):
                if part.name in self.shared and part.name not in done:
                    self.found.add(part.name)
            elif isinstance(part, Item) and part.name in self.shared:
                elements = set(_elements(part, self.sizes[part.name], self.turn))
                self.found.update({part.name} if elements - done else ())


def _elements(item: Item, size: int, turn: Mapping[str, int]) -> Iterator[str]:
    place = _number(item.index, turn)
    places = range(size) if place is None else (place,)
    yield from (f"{item.name}[{k}]" for k in places)


def _number(index: Expr, turn: Mapping[str, int]) -> int | None:
    """Return what an index is in a turn of loops; None if that hangs on something else."""
    match index:
        case Value(value):
            return int(value)
        case Ref(name):
            return turn.get(name)
        case Binary("+" | "-" as operator, left, right):
            first, second = _number(left, turn), _number(right, turn)
            if first is None or second is None:
                return None
            return first + second if operator == "+" else first - second
        case _:
            return None
