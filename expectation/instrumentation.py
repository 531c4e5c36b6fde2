"""Probe: a Program that remembers in which combinations the conditions of its guards were read.

`probe.<k>` is an array with a place for each combination of the conditions of guard k. A sampled
Program reads its guards in its jumps. A continuous one reads them all along its steps; what counts
are jumps, and the instants at which outputs are evaluated (`look`): not what bisection tries. A
chart remembers which modes were active after each micro-step.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from expectation.mcdc import MAX_CONDITIONS, Decision, match_conditions
from language.ir.ops import (
    Assign,
    Binary,
    Block,
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

GUARD_READ_BLOCK = "look"
"""The block that reads the guards of the active modes and does nothing else."""
COMMIT_BLOCK = "commit"
"""The block of a chart that ends a micro-step: its modes are those between two of them."""
GUARDS_PREFIX = "guards_"
PROBED_PREFIX = "probed_"
SELECTION_PREFIXES = ("jump", "count_", "choose_")
"""How the blocks of a sampled Program begin that read guards."""
FIRED_PREFIXES = ("memory.fired", "work.wish_")
"""How the variables begin that hold the transition that is taken, or wished for in a chart."""


@dataclasses.dataclass(frozen=True)
class InstrumentedProgram:
    """A Program with probes, and the array of each decision that has one, by its key path."""

    program: Program
    arrays: Mapping[str, str]


def instrument(program: Program, decisions: Iterable[Decision]) -> InstrumentedProgram:
    """Return a Program, not yet optimised, with probes at its guards."""
    inserter = _ProbeInserter(program, tuple(decisions))
    blocks = dict(program.blocks)
    if program.period is None:
        guards = {n: b for n, b in blocks.items() if n.startswith(GUARDS_PREFIX)}
        blocks |= {
            PROBED_PREFIX + n: _map_operations(b, inserter.insert_after_assignment)
            for n, b in guards.items()
        }
        for name, block in program.blocks.items():
            if name.startswith("jump"):
                blocks[name] = _map_operations(block, _redirect_to_probed)
        blocks[GUARD_READ_BLOCK] = tuple(_guard_reads(program.blocks["watch"]))
    else:
        for name, block in program.blocks.items():
            if name.startswith(SELECTION_PREFIXES):
                blocks[name] = _map_operations(block, inserter.insert_before_firing)
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
    """Return the array of the modes of a chart's region that were active after a micro-step."""
    return mode_variable("reached.mode", region)


class _ProbeInserter:
    """What is put into the blocks of a Program."""

    def __init__(self, program: Program, decisions: tuple[Decision, ...]) -> None:
        self.decisions = tuple(d for d in decisions if len(d.conditions) <= MAX_CONDITIONS)
        self.arrays = {d.key: f"probe.{k}" for k, d in enumerate(self.decisions)}
        self.stored: dict[str, None] = {}
        self._by_key = {f"{program.name} {d.key}": d for d in self.decisions}
        self._timers = {info.key: info.timer for info in program.transitions}

    def insert_after_assignment(self, op: Op) -> Iterator[Op]:
        """A guard is kept in a variable."""
        yield op
        if isinstance(op, Assign) and op.key.endswith(".when"):
            yield from self._store_combination(op.key.removesuffix(".when"), op.value)

    def insert_before_firing(self, op: Op) -> Iterator[Op]:
        """A guard is what a branch asks for that fires, or what a wait counts."""
        match op:
            case Count(_, condition, _, key):
                yield from self._store_combination(key.removesuffix(".when"), condition)
            case Branch(condition, then, _):
                taken = (inner for inner in then if isinstance(inner, Assign))
                for inner in taken:  # where there is a wait the guard is read when it is counted
                    if inner.target.startswith(FIRED_PREFIXES) and not self._timers.get(inner.key):
                        yield from self._store_combination(inner.key, condition)
        yield op

    def _store_combination(self, key: str, guard: Expr) -> Iterator[Op]:
        decision = self._by_key.get(key)
        parts = match_conditions(decision.structure, guard) if decision else None
        if decision is None or parts is None:
            return
        index: Expr = integer(0)
        for k, part in sorted(parts.items()):
            index = Binary("+", index, Select(part, integer(1 << k), integer(0)))
        self.stored[decision.key] = None
        yield Store(self.arrays[decision.key], index, Value(True))


def _map_operations(block: Block, change: Callable[[Op], Iterator[Op]]) -> Block:
    """Return a block in which each operation, inner ones first, is replaced by others."""
    found: list[Op] = []
    for op in block:
        match op:
            case Branch(condition, then, other):
                op = Branch(
                    condition, _map_operations(then, change), _map_operations(other, change)
                )
            case Switch(selector, cases):
                op = Switch(selector, tuple((k, _map_operations(b, change)) for k, b in cases))
        found += change(op)
    return tuple(found)


def _redirect_to_probed(op: Op) -> Iterator[Op]:
    if isinstance(op, RunBlock) and op.block.startswith(GUARDS_PREFIX):
        op = RunBlock(PROBED_PREFIX + op.block)
    yield op


def _guard_reads(block: Sequence[Op]) -> Iterator[Op]:
    """What leads to the guards in `watch`, and nothing that lasts."""
    for op in block:
        match op:
            case Assign(target, _, _) if target.startswith("work."):
                yield op
            case RunBlock(name) if name.startswith(GUARDS_PREFIX):
                yield RunBlock(PROBED_PREFIX + name)
            case Switch(selector, cases):
                yield Switch(selector, tuple((k, tuple(_guard_reads(b))) for k, b in cases))
