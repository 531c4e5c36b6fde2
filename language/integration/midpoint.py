"""Explicit midpoint method of two stages (Runge 1895) with quadratic dense output.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1 (1.4) and II.6. The
quadratic has the first rate at the start of the step and passes through its end. It is of second
order throughout the step, as the method is, and needs no third rate, as a cubic would.
"""

from __future__ import annotations

from collections.abc import Sequence

from language.expressions.units import rate_dimension
from language.integration.crossing_location import (
    IntegrationMethod,
    clear_constant_series,
    hold_constant_states,
)
from language.integration.vector_field import VectorField, set_point_time, set_point_to_state
from language.ir.ops import (
    Assign,
    Block,
    Op,
    Ref,
    RunBlock,
    Store,
    add,
    divide,
    integer,
    multiply,
    real,
    subtract,
)
from language.ir.program import Variable
from language.model.constant_states import never_varying_states, varying_states

TERMS = 2
"""The number of terms of the polynomial."""


def midpoint_method(field: VectorField) -> IntegrationMethod:
    """Return the midpoint method for a field; only states with a rate in a mode are integrated.

    The blocks are `step_<mode>` and `series_<mode>`. Each state has the variables
    `work.first_<state>` and `work.middle_<state>` of its rates; there are no constants.
    """
    blocks: dict[str, Block] = {}
    for mode in field.automaton.modes:
        quadratics = _quadratic_series(varying_states(field.automaton, mode))
        blocks[f"step_{mode}"] = _step_block(field, mode)
        blocks[f"series_{mode}"] = (*quadratics, *clear_constant_series(field, mode, TERMS))
    variables = [
        Variable(f"work.{what}_{name}", "real", str(rate_dimension(state.unit.dimension)))
        for what in ("first", "middle")
        for name, state in field.automaton.states.items()
    ]
    return IntegrationMethod(
        blocks, TERMS, (), tuple(variables), constant_states=never_varying_states(field.automaton)
    )


def _step_block(field: VectorField, mode: str) -> Block:
    """Return the block of one step: x + h f(x + h/2 f(x))."""
    h = Ref("work.h")
    half = multiply(real(0.5), h)
    moves = varying_states(field.automaton, mode)
    ops: list[Op] = [
        *set_point_to_state(field),
        *set_point_time(field, real(0.0)),
        RunBlock(f"rates_{mode}"),
    ]
    for name in moves:
        ops.append(Assign(f"work.first_{name}", Ref(f"work.rate_{name}")))
        moved = add(Ref(f"state.{name}"), multiply(half, Ref(f"work.first_{name}")))
        ops.append(Assign(f"work.at_{name}", moved))
    ops += set_point_time(field, half)
    ops.append(RunBlock(f"rates_{mode}"))
    for name in moves:
        ops.append(Assign(f"work.middle_{name}", Ref(f"work.rate_{name}")))
        moved = add(Ref(f"state.{name}"), multiply(h, Ref(f"work.middle_{name}")))
        ops.append(Assign(f"work.end_{name}", moved))
    return (*ops, *hold_constant_states(field, mode))


def _quadratic_series(states: Sequence[str]) -> Block:
    """Return the coefficients of x0 + s k1 + s^2 (k2 - k1)/h for each state."""
    ops: list[Op] = []
    for name in states:
        first, middle = Ref(f"work.first_{name}"), Ref(f"work.middle_{name}")
        series = f"work.series_{name}"
        ops.append(Store(series, integer(0), first))
        ops.append(Store(series, integer(1), divide(subtract(middle, first), Ref("work.h"))))
    return tuple(ops)
