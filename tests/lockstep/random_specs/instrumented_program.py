"""Probe: a Program that also counts which transitions fire, which guards met, which ranges spoke.

The counters are variables `probe.<what>` that nothing else reads: all other values are as before.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from language.ir.ops import Assign, Block, Branch, Compare, Expr, FaultBit, Op, Ref, add, integer
from language.ir.program import Program, Variable
from language.ir.rewrite_ops import map_operations
from language.ir.traversal import walk_ops

ENABLED = "probe.enabled"
TWO, ORDER, SWITCH = "probe.two", "probe.order", "probe.switch"


def instrument_program(program: Program) -> Program:
    """Return the Program with its counters."""
    blocks = {name: map_operations(block, _counted) for name, block in program.blocks.items()}
    for name, block in blocks.items():
        if name.startswith("jump_"):
            blocks[name] = _jump(block)
        if name.startswith("switch_"):
            blocks[name] = map_operations(block, _switched)
    written = {name for block in blocks.values() for op in walk_ops(block) for name in _probe(op)}
    variables = tuple(Variable(name, "whole") for name in sorted(written))
    return dataclasses.replace(program, blocks=blocks, variables=(*program.variables, *variables))


def _probe(op: Op) -> list[str]:
    return [op.target] if isinstance(op, Assign) and op.target.startswith("probe.") else []


def _more(name: str) -> Op:
    return Assign(name, add(Ref(name, is_integer=True), integer(1)))


def _counted(op: Op) -> Block:
    """A fault bit that is set for a signal."""
    if isinstance(op, FaultBit) and op.value and op.signal:
        return (op, _more(f"probe.fault_{op.signal}"))
    return (op,)


def _switched(op: Op) -> Block:
    """A located transition of the model inside a tick."""
    is_switch = isinstance(op, Assign) and op.target == "memory.run_mode"
    return (op, _more(SWITCH)) if is_switch else (op,)


def _jump(block: Block) -> Block:
    """The chain of guards at the end of a jump: how many hold, and what is passed over."""
    if not block or not isinstance(block[-1], Branch):
        return block
    links = [(link, number) for link in _links(block[-1]) if (number := _number(link.then))]
    chain: Block = ()
    for place in reversed(range(len(links))):
        link, number = links[place]
        later = [other.condition for other, own in links[place + 1 :] if own < number]
        counts: list[Op] = [_more(f"probe.fired_{number}")]
        counts += [Branch(condition, (_more(ORDER),)) for condition in later[:1]]
        chain = (Branch(link.condition, (*counts, *link.then), chain),)
    sums: list[Op] = [Assign(ENABLED, integer(0))]
    sums += [Branch(link.condition, (_more(ENABLED),)) for link, _ in links]
    several: Expr = Compare(">", Ref(ENABLED, is_integer=True), integer(1))
    return (*block[:-1], *sums, Branch(several, (_more(TWO),)), *chain)


def _links(branch: Branch) -> Iterator[Branch]:
    """Yield the branches of a chain of `else if`."""
    link: Op | None = branch
    while isinstance(link, Branch):
        yield link
        link = link.other[0] if len(link.other) == 1 else None


def _number(block: Block) -> int:
    """Return the number of the transition that a block takes, 0 if none."""
    for op in block:
        if isinstance(op, Assign) and op.target.startswith("memory.fired"):
            return int(getattr(op.value, "value", 0))
    return 0
