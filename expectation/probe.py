"""Probe: a Program that remembers in which combinations the conditions of its guards were read.

`probe.<k>` is an array with a place for each combination of the conditions of guard k. A sampled
Program reads its guards in its jumps. A continuous one reads them all along its steps; what counts
are jumps, and the instants at which outputs are evaluated (`look`): not what bisection tries. A
chart remembers which modes were active after each micro-step.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from expectation.decision import MOST_CONDITIONS, Decision, lowered_conditions
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Choose,
    Count,
    Expr,
    Op,
    Ref,
    Run,
    Select,
    Store,
    Value,
    whole,
)
from language.program import Program, Variable, mode_variable

LOOK = "look"
"""The block that reads the guards of the active modes and does nothing else."""
COMMIT = "commit"
"""The block of a chart that ends a micro-step: its modes are those between two of them."""
GUARDS = "guards_"
PROBED = "probed_"
CHOOSING = ("jump", "count_", "choose_")
"""How the blocks of a sampled Program begin that read guards."""
TAKEN = ("memory.fired", "work.wish_")
"""How the variables begin that hold the transition that is taken, or wished for in a chart."""


@dataclasses.dataclass(frozen=True)
class Probed:
    """A Program with probes, and the array of each decision that has one, by its key path."""

    program: Program
    arrays: Mapping[str, str]


def probed(program: Program, decisions: Iterable[Decision]) -> Probed:
    """Return a Program, not yet optimised, with probes at its guards."""
    found = _Probes(program, tuple(decisions))
    blocks = dict(program.blocks)
    if program.period is None:
        guards = {n: b for n, b in blocks.items() if n.startswith(GUARDS)}
        blocks |= {PROBED + n: _everywhere(b, found.after_assigned) for n, b in guards.items()}
        for name, block in program.blocks.items():
            if name.startswith("jump"):
                blocks[name] = _everywhere(block, _with_probes)
        blocks[LOOK] = tuple(_looked(program.blocks["watch"]))
    else:
        for name, block in program.blocks.items():
            if name.startswith(CHOOSING):
                blocks[name] = _everywhere(block, found.before_fired)
    arrays = {key: found.arrays[key] for key in found.stored}
    sizes = {arrays[d.key]: 1 << len(d.conditions) for d in found.decisions if d.key in arrays}
    for region, mode in program.mode_variables().items() if COMMIT in blocks else ():
        array = reached_array(region)
        blocks[COMMIT] = (*blocks[COMMIT], Store(array, Ref(mode, whole=True), Value(True)))
        sizes[array] = 1 + max(each.number for each in program.modes_of(region))
    more = (Variable(name, "truth", size=size) for name, size in sizes.items())
    variables = (*program.variables, *more)
    return Probed(dataclasses.replace(program, blocks=blocks, variables=variables), arrays)


def reached_array(region: str) -> str:
    """Return the array of the modes of a chart's region that were active after a micro-step."""
    return mode_variable("reached.mode", region)


class _Probes:
    """What is put into the blocks of a Program."""

    def __init__(self, program: Program, decisions: tuple[Decision, ...]) -> None:
        self.decisions = tuple(d for d in decisions if len(d.conditions) <= MOST_CONDITIONS)
        self.arrays = {d.key: f"probe.{k}" for k, d in enumerate(self.decisions)}
        self.stored: dict[str, None] = {}
        self._by_key = {f"{program.name} {d.key}": d for d in self.decisions}
        self._timers = {info.key: info.timer for info in program.transitions}

    def after_assigned(self, op: Op) -> Iterator[Op]:
        """A guard is kept in a variable."""
        yield op
        if isinstance(op, Assign) and op.key.endswith(".when"):
            yield from self._store(op.key.removesuffix(".when"), op.value)

    def before_fired(self, op: Op) -> Iterator[Op]:
        """A guard is what a branch asks for that fires, or what a wait counts."""
        match op:
            case Count(_, condition, _, key):
                yield from self._store(key.removesuffix(".when"), condition)
            case Branch(condition, then, _):
                taken = (inner for inner in then if isinstance(inner, Assign))
                for inner in taken:  # where there is a wait the guard is read when it is counted
                    if inner.target.startswith(TAKEN) and not self._timers.get(inner.key):
                        yield from self._store(inner.key, condition)
        yield op

    def _store(self, key: str, guard: Expr) -> Iterator[Op]:
        decision = self._by_key.get(key)
        parts = lowered_conditions(decision.joined, guard) if decision else None
        if decision is None or parts is None:
            return
        index: Expr = whole(0)
        for k, part in sorted(parts.items()):
            index = Binary("+", index, Select(part, whole(1 << k), whole(0)))
        self.stored[decision.key] = None
        yield Store(self.arrays[decision.key], index, Value(True))


def _everywhere(block: Block, change: Callable[[Op], Iterator[Op]]) -> Block:
    """Return a block in which each operation, inner ones first, is replaced by others."""
    found: list[Op] = []
    for op in block:
        match op:
            case Branch(condition, then, other):
                op = Branch(condition, _everywhere(then, change), _everywhere(other, change))
            case Choose(selector, cases):
                op = Choose(selector, tuple((k, _everywhere(b, change)) for k, b in cases))
        found += change(op)
    return tuple(found)


def _with_probes(op: Op) -> Iterator[Op]:
    if isinstance(op, Run) and op.block.startswith(GUARDS):
        op = Run(PROBED + op.block)
    yield op


def _looked(block: Sequence[Op]) -> Iterator[Op]:
    """What leads to the guards in `watch`, and nothing that lasts."""
    for op in block:
        match op:
            case Assign(target, _, _) if target.startswith("work."):
                yield op
            case Run(name) if name.startswith(GUARDS):
                yield Run(PROBED + name)
            case Choose(selector, cases):
                yield Choose(selector, tuple((k, tuple(_looked(b))) for k, b in cases))
