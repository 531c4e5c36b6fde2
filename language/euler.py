"""Euler: the explicit method of one stage (Euler 1768), a straight line inside the step.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, I.7. The line is of the order
of the method; a curve through more rates would promise what the end of the step does not have.
"""

from __future__ import annotations

from language.field import Field, at_state, at_time
from language.motion import Method
from language.operation import Assign, Block, Op, Ref, Run, Store, add, multiply, real, whole

TERMS = 1


def euler(field: Field) -> Method:
    """Return the method for a field."""
    blocks: dict[str, Block] = {}
    for name in field.automaton.modes:
        blocks[f"step_{name}"] = _step(field, name)
        blocks[f"series_{name}"] = tuple(
            Store(f"work.series_{state}", whole(0), Ref(f"work.rate_{state}"))
            for state in field.states
        )
    return Method(blocks, TERMS, (), ())


def _step(field: Field, mode: str) -> Block:
    """x + h f(x)."""
    ops: list[Op] = [*at_state(field), *at_time(field, real(0.0)), Run(f"rates_{mode}")]
    for name in field.states:
        moved = multiply(Ref("work.h"), Ref(f"work.rate_{name}"))
        ops.append(Assign(f"work.end_{name}", add(Ref(f"state.{name}"), moved)))
    return tuple(ops)
