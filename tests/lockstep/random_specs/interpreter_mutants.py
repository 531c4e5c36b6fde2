"""Mutants: mistakes in the interpreter that lock-step on random specs must see."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import pytest

from engine.interpreter.number_arithmetic import ARITHMETIC_OF_TYPE
from language.ir.number_type import NUMBER_TYPES
from language.ir.ops import Assign, Block, Branch, Op, Ref, RunBlock, Value
from language.ir.program import Program, Variable
from tests.lockstep.random_specs.mutant import Mutant, Patch, attribute, item, rewrite_operations

ACTIONS = "engine.interpreter.statement_closures"
SHAPES = "engine.interpreter.expression_closures"


def _elementary(name: str, function: Callable[..., Any]) -> Patch:
    """An elementary operation that is wrong, in both number types."""

    def apply(patch: pytest.MonkeyPatch) -> None:
        for number in NUMBER_TYPES:
            arithmetic = ARITHMETIC_OF_TYPE[number]

            def wrong(*values: Any, real: Any = arithmetic.real) -> Any:
                return real(function(*values))

            patch.setitem(arithmetic.elementary, name, wrong)

    return apply


def _relation(name: str, wrong: Callable[[Any, Any], bool]) -> Patch:
    """A relation that is wrong, whatever its operands are read from."""
    slot, read = (lambda v, a: v[a]), (lambda v, a: a(v))
    shapes = {
        "SLOT_SLOT": (slot, slot),
        "SLOT_EXPRESSION": (slot, read),
        "EXPRESSION_SLOT": (read, slot),
        "EXPRESSION_EXPRESSION": (read, read),
    }

    def made(first: Any, second: Any) -> Any:
        return lambda a, b: lambda v: wrong(first(v, a), second(v, b))

    def apply(patch: pytest.MonkeyPatch) -> None:
        for shape, operands in shapes.items():
            item(f"{SHAPES}.{shape}", name, made(*operands))(patch)

    return apply


def _count(late: int, is_kept: bool) -> Callable[..., Any]:
    def count(slot: int, condition: Any, limit: int) -> Any:
        def act(v: list[Any]) -> None:
            if condition(v):
                v[slot] = min(v[slot] + 1, limit - late)
            elif not is_kept:
                v[slot] = 0

        return act

    return count


def _overwritten(slot: int, bit: int, signal: str, left: int) -> Any:
    def act(v: list[Any]) -> None:
        v[slot] = bit

    return act


def _short_loop(count: int, slot: int, body: Callable[[list[Any]], None]) -> Any:
    def act(v: list[Any]) -> None:
        for index in range(count - 1):
            v[slot] = index
            body(v)

    return act


def _at_once(verb: str) -> Callable[[Op], Block]:
    """What a stage computes is committed before the next of its lines reads."""

    def change(op: Op) -> Block:
        if isinstance(op, Assign) and op.target.startswith((f"work.{verb}_x", f"work.{verb}_z")):
            state = op.target.replace(f"work.{verb}_", "state.")
            return (op, Assign(state, Ref(op.target)))
        return (op,)

    return change


def _stale(op: Op) -> Block:
    """Equations after a jump are left out."""
    is_fired = isinstance(op, Branch) and "memory.fired" in repr(op.condition)
    return () if is_fired and "equations_" in repr(op) and "commit" not in repr(op) else (op,)


def _no_clearing(op: Op) -> Block:
    """Counters of a mode that is left are not cleared."""
    if not isinstance(op, Assign) or not op.target.startswith("timer."):
        return (op,)
    is_whole = isinstance(op.value, Value) and type(op.value.value) is int
    return () if is_whole else (op,)


def _late(program: Program) -> Program:
    """`previous` is one tick later than it should be."""
    more: dict[str, Variable] = {}

    def change(op: Op) -> Block:
        if not isinstance(op, Assign) or not op.target.startswith("memory.delay_"):
            return (op,)
        kind = next(v for v in program.variables if v.name == op.target).type
        late = f"work.late_{op.target.rpartition('_')[2]}"
        more[late] = Variable(late, kind)
        return (Assign(op.target, Ref(late)), Assign(late, op.value))

    made = rewrite_operations(change)(program)
    return dataclasses.replace(made, variables=(*made.variables, *more.values()))


def _early(program: Program) -> Program:
    """`previous` is the value of now: kept before the equations are evaluated."""
    step = program.blocks["step"]
    keep = tuple(op for op in step if op == RunBlock("record_history"))
    place = next((k for k, op in enumerate(step) if "equations_" in repr(op)), 0)
    rest = (*step[:place], *keep, *(op for op in step[place:] if op != RunBlock("record_history")))
    return dataclasses.replace(program, blocks={**program.blocks, "step": rest})


def _any_priority(program: Program) -> Program:
    """The chain of guards of a jump is turned round: the largest priority wins."""

    def turned(block: Block) -> Block:
        last = block[-1] if block else None
        if not isinstance(last, Branch):
            return block
        links: list[Branch] = []
        link: Op | None = last
        while isinstance(link, Branch):
            links.append(link)
            link = link.other[0] if len(link.other) == 1 else None
        chain: Block = ()
        for old in links:
            chain = (Branch(old.condition, old.then, chain),)
        return (*block[:-1], *chain)

    blocks = {n: turned(b) if n.startswith("jump_") else b for n, b in program.blocks.items()}
    return dataclasses.replace(program, blocks=blocks)


INTERPRETER = (
    Mutant(
        "the relation > holds on equality too",
        "interpreter",
        _relation(">", lambda a, b: a >= b),
    ),
    Mutant(
        "the relation <= fails on equality",
        "interpreter",
        _relation("<=", lambda a, b: a < b),
    ),
    Mutant(
        "a counter stops one short",
        "interpreter",
        attribute(f"{ACTIONS}.count_while", _count(1, False)),
    ),
    Mutant(
        "a counter is not cleared",
        "interpreter",
        attribute(f"{ACTIONS}.count_while", _count(0, True)),
    ),
    Mutant(
        "a fault bit wipes out the others",
        "interpreter",
        attribute(f"{ACTIONS}.set_fault", _overwritten),
    ),
    Mutant(
        "a fault bit that is not latched stays",
        "interpreter",
        attribute(f"{ACTIONS}.clear_fault", lambda slot, bit: lambda v: None),
    ),
    Mutant("a loop ends one short", "interpreter", attribute(f"{ACTIONS}.loop", _short_loop)),
    Mutant(
        "min takes the second of equals",
        "interpreter",
        _elementary("min", lambda a, b: b if b <= a else a),
    ),
    Mutant(
        "max takes the second of equals",
        "interpreter",
        _elementary("max", lambda a, b: b if b >= a else a),
    ),
    Mutant(
        "clip makes the upper bound of NaN",
        "interpreter",
        _elementary("clip", lambda x, low, high: (x if x > low else low) if x < high else high),
    ),
    Mutant("sign of 0 is 1", "interpreter", _elementary("sign", lambda x: math.copysign(1.0, x))),
    Mutant(
        "floor rounds towards 0",
        "interpreter",
        _elementary("floor", lambda x: float(math.trunc(float(x))) if math.isfinite(x) else x),
    ),
    Mutant("a reset is sequential", "interpreter", rewrite=rewrite_operations(_at_once("reset"))),
    Mutant("an update is sequential", "interpreter", rewrite=rewrite_operations(_at_once("next"))),
    Mutant("equations are stale after a jump", "interpreter", rewrite=rewrite_operations(_stale)),
    Mutant("counters outlive their mode", "interpreter", rewrite=rewrite_operations(_no_clearing)),
    Mutant("previous is one tick late", "interpreter", rewrite=_late),
    Mutant("previous is the value of now", "interpreter", rewrite=_early),
    Mutant("the largest priority wins", "interpreter", rewrite=_any_priority),
)
