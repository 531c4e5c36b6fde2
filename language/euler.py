"""Euler: the explicit method of one stage (Euler 1768), a straight line inside the step.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, I.7. The line is of the order
of the method; a curve through more rates would promise what the end of the step does not have.
"""

from __future__ import annotations

from language.field import Field, at_state, at_time
from language.motion import Method, at_rest, flat
from language.operation import Assign, Block, Op, Ref, Run, Store, add, multiply, real, whole
from language.resting import moving, never_moving

TERMS = 1


def euler(field: Field) -> Method:
    """Return the method for a field, for the states that move in each mode."""
    blocks: dict[str, Block] = {}
    for mode in field.automaton.modes:
        names = moving(field.automaton, mode)
        lines = [Store(f"work.series_{n}", whole(0), Ref(f"work.rate_{n}")) for n in names]
        blocks[f"step_{mode}"] = _step(field, mode)
        blocks[f"series_{mode}"] = (*lines, *flat(field, mode, TERMS))
    return Method(blocks, TERMS, (), (), resting=never_moving(field.automaton))


def _step(field: Field, mode: str) -> Block:
    """x + h f(x)."""
    ops: list[Op] = [*at_state(field), *at_time(field, real(0.0)), Run(f"rates_{mode}")]
    for name in moving(field.automaton, mode):
        moved = multiply(Ref("work.h"), Ref(f"work.rate_{name}"))
        ops.append(Assign(f"work.end_{name}", add(Ref(f"state.{name}"), moved)))
    return (*ops, *at_rest(field, mode))
