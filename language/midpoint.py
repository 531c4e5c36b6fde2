"""Midpoint: the explicit method of two stages (Runge 1895) with a quadratic inside the step.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1 (1.4) and II.6. The
quadratic starts with the first rate and ends at the end of the step: it is of second order all
through the step, as the method is, and needs no third rate as a cubic would.
"""

from __future__ import annotations

from collections.abc import Sequence

from language.field import Field, at_state, at_time
from language.motion import Method, at_rest, flat
from language.operation import (
    Assign,
    Block,
    Op,
    Ref,
    Run,
    Store,
    add,
    divide,
    multiply,
    real,
    subtract,
    whole,
)
from language.program import Variable
from language.resting import moving, never_moving
from language.units import per_second

TERMS = 2


def midpoint(field: Field) -> Method:
    """Return the method for a field, for the states that move in each mode."""
    blocks: dict[str, Block] = {}
    for mode in field.automaton.modes:
        quadratics = _quadratics(moving(field.automaton, mode))
        blocks[f"step_{mode}"] = _step(field, mode)
        blocks[f"series_{mode}"] = (*quadratics, *flat(field, mode, TERMS))
    variables = [
        Variable(f"work.{what}_{name}", "real", str(per_second(state.unit.dimension)))
        for what in ("first", "middle")
        for name, state in field.automaton.states.items()
    ]
    return Method(blocks, TERMS, (), tuple(variables), resting=never_moving(field.automaton))


def _step(field: Field, mode: str) -> Block:
    """x + h f(x + h/2 f(x))."""
    h = Ref("work.h")
    half = multiply(real(0.5), h)
    moves = moving(field.automaton, mode)
    ops: list[Op] = [*at_state(field), *at_time(field, real(0.0)), Run(f"rates_{mode}")]
    for name in moves:
        ops.append(Assign(f"work.first_{name}", Ref(f"work.rate_{name}")))
        moved = add(Ref(f"state.{name}"), multiply(half, Ref(f"work.first_{name}")))
        ops.append(Assign(f"work.at_{name}", moved))
    ops += at_time(field, half)
    ops.append(Run(f"rates_{mode}"))
    for name in moves:
        ops.append(Assign(f"work.middle_{name}", Ref(f"work.rate_{name}")))
        moved = add(Ref(f"state.{name}"), multiply(h, Ref(f"work.middle_{name}")))
        ops.append(Assign(f"work.end_{name}", moved))
    return (*ops, *at_rest(field, mode))


def _quadratics(states: Sequence[str]) -> Block:
    """x0 + s k1 + s^2 (k2 - k1)/h."""
    ops: list[Op] = []
    for name in states:
        first, middle = Ref(f"work.first_{name}"), Ref(f"work.middle_{name}")
        series = f"work.series_{name}"
        ops.append(Store(series, whole(0), first))
        ops.append(Store(series, whole(1), divide(subtract(middle, first), Ref("work.h"))))
    return tuple(ops)
