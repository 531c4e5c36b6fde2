"""Continuous steps: integration over `work.h` up to the first crossing, which is located.

An integration method supplies a block `step_<mode>` from the states to `work.end_<state>`, a block
`series_<mode>` that fills `work.series_<state>` with a polynomial through the step, and the number
of its terms. This module adds the common part: the guards are evaluated at the end of the step; if
one has changed, the crossing is located by bisection on the polynomial. The upper end of the
bracket is committed, so the guard is true there (rules 9 and 10).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from language.expressions.units import rate_dimension
from language.integration.dense_output import DenseOutput, event_search_block
from language.integration.vector_field import VectorField, any_guard_condition, set_point_time
from language.ir.number_type import NumberType
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Expr,
    Loop,
    Op,
    Ref,
    RunBlock,
    Store,
    Unary,
    Value,
    add,
    integer,
    multiply,
    real,
    subtract,
)
from language.ir.program import Constant, Variable
from language.lowering.guard_variable_names import guard_slots
from language.model.automaton import Mode
from language.model.constant_states import constant_states, ever_varying_states

RUN_BISECTIONS = 24
"""Bisections inside a tick: 1 ms / 2^24 = 60 ps (rule 9); in float32 one unit in the last place."""
FLOW_BISECTIONS: Mapping[NumberType, int] = {"float64": 44, "float32": 24}
"""Bisections in a step of a continuous automaton.

1 ms / 2^44 is below one unit in the last place of a time of 1 s. In float32 a time within a step
has 24 bits; after 24 bisections the middle of the bracket equals one of its ends.
"""

ArmedGuards = Mapping[str, str]


@dataclass(frozen=True)
class IntegrationMethod:
    """The blocks of an integration method for one vector field.

    `step_norms` is |A h| of each mode if the method computes it. `constant_states` are the states
    whose rate is 0 in all modes; they have no polynomial.
    """

    blocks: dict[str, Block]
    terms: int
    constants: tuple[Constant, ...]
    variables: tuple[Variable, ...]
    step_norms: Mapping[str, float] = field(default_factory=dict)
    constant_states: frozenset[str] = frozenset()


def hold_constant_states(field: VectorField, mode: str) -> list[Op]:
    """Return the assignments `work.end_x = state.x` of the states whose rate is 0 in a mode.

    `mode` is the name of the mode; the order is that of the file.
    """
    still = constant_states(field.automaton.modes[mode])
    return [Assign(f"work.end_{n}", Ref(f"state.{n}")) for n in field.states if n in still]


def clear_constant_series(field: VectorField, mode: str, terms: int) -> list[Op]:
    """Return the assignments of a zero polynomial to the states whose rate is 0 in a mode.

    Each of the `terms` coefficients is set to 0. States whose rate is 0 in all modes have no
    polynomial and are left out.
    """
    still = constant_states(field.automaton.modes[mode])
    names = [name for name in ever_varying_states(field.automaton) if name in still]
    return [Store(f"work.series_{n}", integer(k), real(0.0)) for n in names for k in range(terms)]


def continuous_step_blocks(
    field: VectorField,
    method: IntegrationMethod,
    flows: Mapping[str, Block],
    merge: Expr,
    bisections: int,
    armed: Callable[[Mode], ArmedGuards | None],
    is_wait: Expr | None = None,
) -> dict[str, Block]:
    """Return `point` and the blocks `dense_guards_`, `locate_` and `flow_` of each mode.

    `flow_<mode>` makes a step up to the first crossing, `locate_<mode>` finds it in `bisections`
    halvings, `dense_guards_<mode>` evaluates the guards on the polynomial, `point` the states.
    `flows` are the blocks of the field. Crossings within `merge` [s] are one instant. `armed` gives
    the variables of the earlier truth of a mode's guards, or None if any true guard is a crossing.
    `is_wait` is the condition that a wait ends with the step: then a crossing shortly after the end
    is at that instant.
    """
    paths = DenseOutput(method.terms, method.constant_states)
    blocks = {"point": paths.evaluate(field.states)}
    for mode in field.automaton.modes.values():
        blocks[f"dense_guards_{mode.name}"] = event_search_block(field, mode, paths, flows)
        crossed = any_guard_condition(field, mode, armed(mode))
        blocks[f"locate_{mode.name}"] = _bisect_crossing(field, mode, crossed, bisections, merge)
        blocks[f"flow_{mode.name}"] = _lower_continuous_step(field, mode, crossed, merge, is_wait)
    return blocks


def continuous_step_variables(field: VectorField, method: IntegrationMethod) -> list[Variable]:
    """Return the `work` variables of a continuous step and of the method.

    States without a polynomial have only `work.end_<state>`; the others also `work.sum_<state>` and
    the array `work.series_<state>`. The variables of the method come last.
    """
    found = [
        Variable("work.h", "real", "s", about="step to flow over"),
        Variable("work.elapsed", "real", "s", about="part of the step until a crossing"),
        Variable("work.crossed", "truth", about="a guard has turned true in the step"),
        Variable("work.s", "real", "s", about="time since the start of the step"),
        Variable("work.low", "real", "s"),
        Variable("work.high", "real", "s"),
        Variable("work.halving", "whole"),
        Variable(
            "work.is_before_end", "truth", about="a guard turns true before the end of the step"
        ),
        Variable("work.term", "whole"),
        *(Variable(f"work.guard_{k}_at_high", "truth") for k in field.guard_slots),
    ]
    for name, state in field.automaton.states.items():
        dimension = state.unit.dimension
        unit, rate = str(dimension), str(rate_dimension(dimension))
        found.append(Variable(f"work.end_{name}", "real", unit, about="at the end of the step"))
        if name in method.constant_states:
            continue
        found.append(Variable(f"work.sum_{name}", "real", rate))
        about = "factor of s; those of s^2, s^3, ... have one more 1/s each"
        found.append(Variable(f"work.series_{name}", "real", rate, about=about, size=method.terms))
    return [*found, *method.variables]


def _bisect_crossing(
    field: VectorField, mode: Mode, crossed: Expr, bisections: int, merge: Expr
) -> Block:
    """Return the operations that halve (low, high]: a guard has changed at high and none at low.

    `work.elapsed` becomes the upper end, and `work.end_<state>` the states there.
    """
    low, high, inside = Ref("work.low"), Ref("work.high"), "work.is_before_end"
    middle = add(low, multiply(real(0.5), subtract(high, low)))
    body: Block = (
        *_evaluate_guards_at(mode, middle),
        Branch(
            crossed,
            (Assign("work.high", Ref("work.s")), Assign(inside, Value(True))),
            (Assign("work.low", Ref("work.s")),),
        ),
    )
    return (
        Assign("work.low", real(0.0)),
        Assign("work.high", Ref("work.h")),
        Assign(inside, Value(False)),
        Loop(bisections, "work.halving", body),
        *_accept_upper_end(field, mode, Ref(inside)),
        *_merge_close_events(field, mode, merge),
        Assign("work.elapsed", Call("min", (high, Ref("work.h")))),
    )


def _accept_upper_end(field: VectorField, mode: Mode, is_before_end: Expr) -> Block:
    """Return the operations that take the upper end of the bracket as the end of the step.

    They do so only if it lies before the end. With two or more guards, the guards are evaluated
    there.
    """
    high = Ref("work.high")
    accept = (Assign("work.s", high), *_accept_point(field))
    if len(guard_slots(mode)) < 2:
        return (Branch(is_before_end, accept),)
    return (
        Branch(
            is_before_end,
            (*accept, RunBlock(f"guards_{mode.name}")),
            _evaluate_guards_at(mode, high),
        ),
    )


def _evaluate_guards_at(mode: Mode, time: Expr, comment: str = "") -> Block:
    """Return the operations that evaluate the guards of a mode at `time` [s] of the step."""
    return (Assign("work.s", time, comment), RunBlock(f"dense_guards_{mode.name}"))


def _accept_point(field: VectorField) -> Block:
    """Return the operations that set the end of the step to the polynomial at `work.s`."""
    keep = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in field.states]
    return (RunBlock("point"), *keep)


def _merge_close_events(field: VectorField, mode: Mode, merge: Expr) -> Block:
    """Return the operations that merge a crossing of another guard within `merge` [s].

    The guards at the first crossing are stored; one that is false there and true `merge` later
    moves the end to the later time. A mode with a single guard has no such operations.
    """
    watched = guard_slots(mode)
    if len(watched) < 2:
        return ()
    first = [Assign(f"work.guard_{k}_at_high", Ref(f"work.guard_{k}")) for k in watched]
    another: Expr = Value(False)
    for position, k in enumerate(watched):
        turned = Binary("and", Ref(f"work.guard_{k}"), Unary("not", Ref(f"work.guard_{k}_at_high")))
        another = turned if position == 0 else Binary("or", another, turned)
    high = Ref("work.high")
    accepted: Block = (Assign("work.high", Ref("work.s")), *_accept_point(field))
    return (
        *first,
        *_evaluate_guards_at(
            mode, add(high, merge), "what turns true until then does so at the same instant"
        ),
        Branch(another, accepted),
    )


def _lower_continuous_step(
    field: VectorField, mode: Mode, crossed: Expr, merge: Expr, is_wait: Expr | None
) -> Block:
    """Return the block `flow_<mode>`: one step, cut at the first crossing.

    A mode without guards makes the whole step.
    """
    watched = guard_slots(mode)
    ops: list[Op] = [RunBlock(f"step_{mode.name}"), Assign("work.elapsed", Ref("work.h"))]
    if watched:
        ops += [Assign(f"work.at_{name}", Ref(f"work.end_{name}")) for name in field.states]
        ops += set_point_time(field, Ref("work.h"))
        ops.append(RunBlock(f"guards_{mode.name}"))
    ops.append(Assign("work.crossed", crossed if watched else Value(False)))
    if watched:
        found: Block = (RunBlock(f"series_{mode.name}"), RunBlock(f"locate_{mode.name}"))
        just_after = (
            () if is_wait is None else _merge_event_after_wait(field, mode, crossed, merge, is_wait)
        )
        ops.append(Branch(Ref("work.crossed"), found, just_after))
    ops += [Assign(f"state.{name}", Ref(f"work.end_{name}")) for name in field.states]
    return tuple(ops)


def _merge_event_after_wait(
    field: VectorField, mode: Mode, crossed: Expr, merge: Expr, is_wait: Expr
) -> Block:
    """Return the operations that test for a crossing within `merge` [s] after the end of a wait.

    Such a crossing is at the end of the wait.
    """
    look = (RunBlock(f"series_{mode.name}"), *_evaluate_guards_at(mode, add(Ref("work.h"), merge)))
    change = Branch(crossed, (Assign("work.crossed", Value(True)), *_accept_point(field)))
    return (Branch(is_wait, (*look, change)),)
