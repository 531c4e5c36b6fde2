"""Instrumentation: add operations to a Program that record the values of guard conditions.

The array `probe.<k>` has an element for each combination of the conditions of guard k. A sampled
Program evaluates guards when it selects transitions. A continuous Program evaluates them also
during the search for crossings; only jumps and output instants (block `read_guards`) are recorded.
A chart also records the active modes after each micro-step.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence

from expectation.mcdc import MAX_CONDITIONS, Decision, match_conditions
from language.ir.ops import (
    Assign,
    Binary,
    Branch,
    Count,
    Expr,
    Op,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
    Value,
    integer,
)
from language.ir.program import Program, Variable, mode_variable
from language.ir.rewrite_ops import map_operations

GUARD_READ_BLOCK = "read_guards"
"""The block that evaluates and records the guards of the active modes, without other effects."""
COMMIT_BLOCK = "commit"
"""The block of a chart that ends a micro-step."""
GUARDS_PREFIX = "guards_"
"""Prefix of the blocks of a continuous Program that evaluate guards."""
PROBED_PREFIX = "probed_"
"""Prefix of the instrumented copies of these blocks."""


@dataclasses.dataclass(frozen=True)
class InstrumentedProgram:
    """An instrumented Program with the array of each recorded decision, by key path."""

    program: Program
    arrays: Mapping[str, str]


def instrument(program: Program, decisions: Iterable[Decision]) -> InstrumentedProgram:
    """Return an instrumented copy of a Program that has not been optimised.

    Decisions with more than MAX_CONDITIONS conditions, and guards whose lowered form does not
    match, are not recorded. The pass adds a store after (continuous) or before (sampled) each
    guard::

        work.guard = a and b   ->   work.guard = a and b
                                    probe.k[(a ? 1 : 0) + (b ? 2 : 0)] = true

    A continuous Program also gets the block GUARD_READ_BLOCK, a chart the arrays `reached_array`.
    """
    inserter = _ProbeInserter(program, tuple(decisions))
    blocks = dict(program.blocks)
    if program.period is None:
        guards = {n: b for n, b in blocks.items() if n.startswith(GUARDS_PREFIX)}
        blocks |= {
            PROBED_PREFIX + n: map_operations(b, inserter.insert_after_assignment)
            for n, b in guards.items()
        }
        for name, block in program.blocks.items():
            if name.startswith("jump"):
                blocks[name] = map_operations(block, _redirect_to_probed)
        blocks[GUARD_READ_BLOCK] = tuple(_guard_reads(program.blocks["evaluate_guards"]))
    else:
        blocks = {n: map_operations(b, inserter.insert_before_firing) for n, b in blocks.items()}
    arrays = {key: inserter.arrays[key] for key in inserter.stored}
    sizes = {arrays[d.key]: 1 << len(d.conditions) for d in inserter.decisions if d.key in arrays}
    for region, mode in program.mode_variables().items() if COMMIT_BLOCK in blocks else ():
        array = reached_array(region)
        blocks[COMMIT_BLOCK] = (
            *blocks[COMMIT_BLOCK],
            Store(array, Ref(mode, is_integer=True), Value(True)),
        )
        sizes[array] = 1 + max(each.number for each in program.modes_of(region))
    more = (Variable(name, "truth", size=size) for name, size in sizes.items())
    variables = (*program.variables, *more)
    return InstrumentedProgram(
        dataclasses.replace(program, blocks=blocks, variables=variables), arrays
    )


def reached_array(region: str) -> str:
    """Return the name of the array of modes of a region that were active after a micro-step.

    It is `reached.mode`, with the suffix that `mode_variable` gives to a parallel region.
    """
    return mode_variable("reached.mode", region)


class _ProbeInserter:
    """Insertion of stores into the blocks of a Program; `stored` are the keys that got one."""

    def __init__(self, program: Program, decisions: tuple[Decision, ...]) -> None:
        self.decisions = tuple(d for d in decisions if len(d.conditions) <= MAX_CONDITIONS)
        self.arrays = {d.key: f"probe.{k}" for k, d in enumerate(self.decisions)}
        self.stored: dict[str, None] = {}
        by_key = {f"{program.name} {d.key}": d for d in self.decisions}
        decided = [(info, by_key[info.key]) for info in program.transitions if info.key in by_key]
        self._by_guard = {info.guard_key: decision for info, decision in decided}
        self._by_branch = {info.key: decision for info, decision in decided if not info.timer}

    def insert_after_assignment(self, op: Op) -> Iterator[Op]:
        """Yield an operation, and a store after it if it assigns a guard."""
        yield op
        if isinstance(op, Assign):
            yield from self._store_combination(self._by_guard.get(op.key), op.value)

    def insert_before_firing(self, op: Op) -> Iterator[Op]:
        """Yield an operation, preceded by a store if it evaluates a guard.

        These are counters of waits, and branches that select a transition without a wait.
        """
        match op:
            case Count(_, condition, _, key):
                yield from self._store_combination(self._by_guard.get(key), condition)
            case Branch(condition, then, _):
                for inner in then:
                    if isinstance(inner, Assign):
                        yield from self._store_combination(
                            self._by_branch.get(inner.key), condition
                        )
        yield op

    def _store_combination(self, decision: Decision | None, guard: Expr) -> Iterator[Op]:
        """Yield a store of the combination of a guard's conditions.

        Yield nothing without a decision, or if its structure does not match.
        """
        parts = match_conditions(decision.structure, guard) if decision else None
        if decision is None or parts is None:
            return
        index: Expr = integer(0)
        for k, part in sorted(parts.items()):
            index = Binary("+", index, Select(part, integer(1 << k), integer(0)))
        self.stored[decision.key] = None
        yield Store(self.arrays[decision.key], index, Value(True))


def _redirect_to_probed(op: Op) -> Iterator[Op]:
    """Yield an operation; a call of a guard block calls its instrumented copy instead."""
    if isinstance(op, RunBlock) and op.block.startswith(GUARDS_PREFIX):
        op = RunBlock(PROBED_PREFIX + op.block)
    yield op


def _guard_reads(block: Sequence[Op]) -> Iterator[Op]:
    """Yield the evaluations of guards in `evaluate_guards`, without stores to lasting variables."""
    for op in block:
        match op:
            case Assign(target, _, _) if target.startswith("work."):
                yield op
            case RunBlock(name) if name.startswith(GUARDS_PREFIX):
                yield RunBlock(PROBED_PREFIX + name)
            case Switch(selector, cases):
                yield Switch(selector, tuple((k, tuple(_guard_reads(b))) for k, b in cases))
