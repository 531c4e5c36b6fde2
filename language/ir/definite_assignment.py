"""Definite assignment: the work variables that a step may read before it assigns them (rule C22).

Only these are set to 0 when a step begins. All others are assigned on every path that leads to a
read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Store,
    Switch,
    Value,
)
from language.ir.program import MODE_VARIABLE, Program
from language.ir.rewrite_ops import direct_expressions, walk_post_order

WORK = "work."
NameSet = frozenset[str]


def find_unassigned_reads(
    program: Program, entry: str, shared: frozenset[str], are_modes_known: bool = True
) -> frozenset[str]:
    """Return the shared work variables that the block `entry` may read before it assigns them.

    Blocks that it runs are followed. For an array it is enough that one element that may be read is
    unassigned. Without `are_modes_known` the mode may have any number, as a compiler assumes: then
    a switch may take none of its cases, even if they are all modes.
    """
    analysis = _AssignmentAnalysis(program, shared, are_modes_known)
    analysis.analyse_block(program.blocks[entry], frozenset())
    return frozenset(analysis.unassigned_reads)


class _AssignmentAnalysis:
    """A forward data-flow analysis: the names that are assigned on every path to an operation.

    An element of an array has the name `array[index]`. A block is analysed once for each set of
    assigned names and loop indices with which it runs.
    """

    def __init__(self, program: Program, shared: frozenset[str], are_modes_known: bool) -> None:
        self.program = program
        self.shared = shared
        self.sizes = {v.name: v.size for v in program.variables if v.size}
        self.modes = {mode.number for mode in program.modes} if are_modes_known else set()
        self.summaries: dict[tuple[str, NameSet, frozenset[tuple[str, int]]], NameSet] = {}
        self.loop_indices: dict[str, int] = {}
        self.unassigned_reads: set[str] = set()

    def analyse_block(self, block: Block, assigned: NameSet) -> NameSet:
        """Return the names that are assigned after a block, given those assigned before it.

        Reads of unassigned shared variables are added to `unassigned_reads`.
        """
        for op in block:
            for expr in direct_expressions(op):
                self._check_reads(expr, assigned)
            assigned = self._analyse_op(op, assigned)
        return assigned

    def _analyse_op(self, op: Op, assigned: NameSet) -> NameSet:
        """Return the names that are assigned after an operation.

        A branch gives the intersection of its arms. A switch does so only if its cases cover all
        modes.
        """
        match op:
            case Assign(target, _, _):
                return assigned | {target}
            case Store(array, index, _):
                place = _index_value(index, self.loop_indices)
                return assigned if place is None else assigned | {f"{array}[{place}]"}
            case Branch(_, then, other):
                return self.analyse_block(then, assigned) & self.analyse_block(other, assigned)
            case Switch(selector, cases):
                self._check_reads(Ref(selector), assigned)
                ends = [self.analyse_block(case, assigned) for _, case in cases]
                every = self.modes if selector == MODE_VARIABLE else set()
                if every and {number for number, _ in cases} >= every:
                    return frozenset.intersection(*ends)
                return assigned  # possibly no case is taken
            case Loop(count, index, body) if count:
                return self._analyse_loop(count, index, body, assigned | {index})
            case RunBlock(name):
                key = name, assigned, frozenset(self.loop_indices.items())
                if key not in self.summaries:
                    self.summaries[key] = self.analyse_block(self.program.blocks[name], assigned)
                return self.summaries[key]
            case _:
                return assigned

    def _analyse_loop(self, count: int, index: str, body: Block, assigned: NameSet) -> NameSet:
        """Return the names that are assigned after a loop.

        Every iteration of a loop that stores into an array is followed, with a known index; of any
        other loop only the first.
        """
        if not any(isinstance(op, Store) for op in body):
            return self.analyse_block(body, assigned)
        for turn in range(count):
            self.loop_indices[index] = turn
            assigned = self.analyse_block(body, assigned)
        del self.loop_indices[index]
        return assigned

    def _check_reads(self, expr: Expr, assigned: NameSet) -> None:
        """Record the shared variables and arrays of an expression that are not assigned."""
        for part in walk_post_order(expr):
            if isinstance(part, Ref):
                if part.name in self.shared and part.name not in assigned:
                    self.unassigned_reads.add(part.name)
            elif isinstance(part, Item) and part.name in self.shared:
                elements = set(_elements(part, self.sizes[part.name], self.loop_indices))
                self.unassigned_reads.update({part.name} if elements - assigned else ())


def _elements(item: Item, size: int, loop_indices: Mapping[str, int]) -> Iterator[str]:
    """Yield the array elements that a read may access: one for a known index, else all."""
    place = _index_value(item.index, loop_indices)
    places = range(size) if place is None else (place,)
    yield from (f"{item.name}[{k}]" for k in places)


def _index_value(index: Expr, loop_indices: Mapping[str, int]) -> int | None:
    """Return the value of an index in the current loop iterations.

    Returns None if it depends on anything else.
    """
    match index:
        case Value(value):
            return int(value)
        case Ref(name):
            return loop_indices.get(name)
        case Binary("+" | "-" as operator, left, right):
            first, second = _index_value(left, loop_indices), _index_value(right, loop_indices)
            if first is None or second is None:
                return None
            return first + second if operator == "+" else first - second
        case _:
            return None
