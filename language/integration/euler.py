"""Explicit Euler method (Euler 1768) with linear dense output.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section I.7. The linear
polynomial has the order of the method, so a polynomial of higher degree would not be more accurate.
"""

from __future__ import annotations

from language.integration.crossing_location import (
    IntegrationMethod,
    clear_constant_series,
    hold_constant_states,
)
from language.integration.vector_field import VectorField, set_point_time, set_point_to_state
from language.ir.ops import Assign, Block, Op, Ref, RunBlock, Store, add, integer, multiply, real
from language.model.constant_states import never_varying_states, varying_states

TERMS = 1
"""The number of terms of the polynomial."""


def euler_method(field: VectorField) -> IntegrationMethod:
    """Return the Euler method for a field; in each mode only states with a rate are integrated.

    The blocks are `step_<mode>` and `series_<mode>`; there are no constants and no variables.
    """
    blocks: dict[str, Block] = {}
    for mode in field.automaton.modes:
        names = varying_states(field.automaton, mode)
        lines = [Store(f"work.series_{n}", integer(0), Ref(f"work.rate_{n}")) for n in names]
        blocks[f"step_{mode}"] = _step_block(field, mode)
        blocks[f"series_{mode}"] = (*lines, *clear_constant_series(field, mode, TERMS))
    return IntegrationMethod(
        blocks, TERMS, (), (), constant_states=never_varying_states(field.automaton)
    )


def _step_block(field: VectorField, mode: str) -> Block:
    """Return the block of one step: x + h f(x)."""
    ops: list[Op] = [
        *set_point_to_state(field),
        *set_point_time(field, real(0.0)),
        RunBlock(f"rates_{mode}"),
    ]
    for name in varying_states(field.automaton, mode):
        moved = multiply(Ref("work.h"), Ref(f"work.rate_{name}"))
        ops.append(Assign(f"work.end_{name}", add(Ref(f"state.{name}"), moved)))
    return (*ops, *hold_constant_states(field, mode))
