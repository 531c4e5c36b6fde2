"""Classical Runge-Kutta method of order 4 (Kutta 1901) with cubic Hermite dense output.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.1 table 1.2 and II.6 (6.7).
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
    Expr,
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
from language.model.constant_states import ever_varying_states, never_varying_states, varying_states

TERMS = 3
"""The number of terms of the polynomial."""
STAGES = (1, 2, 3, 4)
HERMITE_BLOCK = "cubic"
"""The block of the polynomial that all modes share."""


def rk4_method(field: VectorField) -> IntegrationMethod:
    """Return the Runge-Kutta method for a field.

    In each mode only states with a rate are integrated. If `has_stage_blocks` is set, the
    operations that all modes share are the blocks `stage_<k>` and `cubic`: an ECU that computes
    floating point in software then has the values of one stage on its stack instead of all. There
    are no constants; each state has the variables `work.k1_<state>` to `work.k4_<state>` and
    `work.slope_<state>`.
    """
    alike = ever_varying_states(field.automaton)
    blocks: dict[str, Block] = {}
    if field.has_stage_blocks:
        blocks.update({f"stage_{stage}": tuple(_stage_ops(alike, stage)) for stage in STAGES})
        blocks[HERMITE_BLOCK] = tuple(_hermite_series(alike))
    for mode in field.automaton.modes:
        own = () if field.has_stage_blocks else varying_states(field.automaton, mode)
        blocks[f"step_{mode}"] = _step_block(field, own, mode)
        blocks[f"series_{mode}"] = (
            *_series_block(field, own, mode),
            *clear_constant_series(field, mode, TERMS),
        )
    units = {name: rate_dimension(s.unit.dimension) for name, s in field.automaton.states.items()}
    variables = [
        Variable(f"work.{what}_{name}", "real", str(unit))
        for what in (*(f"k{stage}" for stage in STAGES), "slope")
        for name, unit in units.items()
    ]
    return IntegrationMethod(
        blocks, TERMS, (), tuple(variables), constant_states=never_varying_states(field.automaton)
    )


def _step_block(field: VectorField, states: Sequence[str], mode: str) -> Block:
    """Return the block of one step of `states`.

    Shared stage blocks integrate the other states too. A state that is constant in this mode has
    the rate 0 there, and its end value is overwritten.
    """
    ops: list[Op] = [*set_point_to_state(field), *set_point_time(field, real(0.0))]
    for stage in STAGES:
        ops.append(RunBlock(f"rates_{mode}"))
        ops += [RunBlock(f"stage_{stage}")] if field.has_stage_blocks else []
        ops += _stage_ops(states, stage)
        ops += set_point_time(field, _stage_time(stage)) if stage != STAGES[-1] else []
    return (*ops, *hold_constant_states(field, mode))


def _stage_ops(states: Sequence[str], stage: int) -> list[Op]:
    """Return the operations of a stage: store the rates, then set the next point or the end."""
    ops: list[Op] = [Assign(f"work.k{stage}_{n}", Ref(f"work.rate_{n}")) for n in states]
    if stage == STAGES[-1]:
        return ops + [Assign(f"work.end_{name}", _end_value(name)) for name in states]
    for name in states:
        moved = add(
            Ref(f"state.{name}"), multiply(_stage_time(stage), Ref(f"work.k{stage}_{name}"))
        )
        ops.append(Assign(f"work.at_{name}", moved))
    return ops


def _stage_time(stage: int) -> Expr:
    """Return the time in the step [s] at which the rates after a stage are evaluated."""
    h = Ref("work.h")
    return h if stage == STAGES[-2] else multiply(real(0.5), h)


def _end_value(name: str) -> Expr:
    """Return x + h/6 (k1 + 2 k2 + 2 k3 + k4)."""
    k1, k2, k3, k4 = (Ref(f"work.k{stage}_{name}") for stage in STAGES)
    inner = add(add(add(k1, multiply(real(2.0), k2)), multiply(real(2.0), k3)), k4)
    return add(Ref(f"state.{name}"), multiply(divide(Ref("work.h"), real(6.0)), inner))


def _series_block(field: VectorField, states: Sequence[str], mode: str) -> Block:
    """Return the operations that evaluate the rates at the end and fill the series."""
    return (
        *(Assign(f"work.at_{name}", Ref(f"work.end_{name}")) for name in field.states),
        *set_point_time(field, Ref("work.h")),
        RunBlock(f"rates_{mode}"),
        *((RunBlock(HERMITE_BLOCK),) if field.has_stage_blocks else ()),
        *_hermite_series(states),
    )


def _hermite_series(states: Sequence[str]) -> list[Op]:
    """Return the coefficients of the cubic through both ends with the rates there.

    The rates are f0 = k1 at the start and f1 at the end of the step.
    """
    h = Ref("work.h")
    ops: list[Op] = []
    for name in states:
        f0, f1 = Ref(f"work.k1_{name}"), Ref(f"work.rate_{name}")
        slope, series = Ref(f"work.slope_{name}"), f"work.series_{name}"
        rise = subtract(Ref(f"work.end_{name}"), Ref(f"state.{name}"))
        ops.append(Assign(slope.name, divide(rise, h)))
        second = subtract(subtract(multiply(real(3.0), slope), multiply(real(2.0), f0)), f1)
        third = subtract(add(f0, f1), multiply(real(2.0), slope))
        ops.append(Store(series, integer(0), f0))
        ops.append(Store(series, integer(1), divide(second, h)))
        ops.append(Store(series, integer(2), divide(third, multiply(h, h))))
    return ops
