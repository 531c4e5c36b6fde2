"""Transitions with `rewind`: the transition is made at the past crossing of its `until` condition.

The block `rollback_<mode>_<index>` searches backwards for the latest tick with `until` false. The
crossing lies in the tick after it, on the flow of the source from the recorded states and inputs,
and is located by bisection. The micro-step is made there. The run of the target then carries the
states over the rest of that tick and over each later tick. If `until` was true in all recorded
ticks, or is false at present, nothing is rolled back and, unless the spec says otherwise, a fault
bit is set.
"""

from __future__ import annotations

from language.integration.crossing_location import RUN_BISECTIONS
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Compare,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    RunBlock,
    Unary,
    add,
    integer,
    multiply,
    real,
    subtract,
)
from language.ir.program import Variable
from language.lowering.expressions import NameBindings, lower_equations, lower_expression
from language.lowering.program_builder import equation_variables
from language.lowering.tick_history import (
    HISTORY_LENGTH,
    Rollback,
    load_current_inputs,
    load_current_states,
    load_recorded_inputs,
    load_recorded_run_inputs,
    load_recorded_states,
    recorded_input_ref,
    recorded_inputs,
    rollback_targets,
    rollbacks_from,
    rolled_back_states,
    run_inputs,
    set_history_index,
    tick_history_variables,
)
from language.model.automaton import Automaton, Mode
from language.model.constant_states import varying_states
from language.model.region_queries import equation_closure, equation_formulas
from language.programs.model_run import run_block, saturate_moved_states

REWIND_LIMIT = "rewind_limit"
"""The fault bit of a rewind without a crossing."""
TICKS_BACK = Ref("work.ticks_back", is_integer=True)
"""The number of ticks since `until` was false; 0 if no such tick was found."""
LOOKBACK_INDEX = Ref("work.lookback_index", is_integer=True)
"""The index of the loops over recorded ticks."""
IS_UNTIL_TRUE = Ref("work.until")
"""The variable of the truth of `until`."""
REMAINING_TIME = Ref("work.rest")
"""The time from the crossing to the end of its tick [s]."""


def rollback_blocks(automaton: Automaton, mode: Mode, now: NameBindings) -> dict[str, Block]:
    """Return the blocks `until_<...>` and `rollback_<...>` of a mode's transitions with `rewind`.

    The suffix is `<mode>_<index>`, with the index of the transition. `now` are the bindings without
    equations. The dict is empty without such transitions.
    """
    blocks: dict[str, Block] = {}
    for rollback in rollbacks_from(automaton, mode):
        blocks[f"until_{rollback.block_suffix}"] = _until_block(rollback, now)
        blocks[f"rollback_{rollback.block_suffix}"] = _rollback_block(rollback, now)
    return blocks


def advance_blocks(automaton: Automaton, mode: Mode) -> dict[str, Block]:
    """Return the block `run_<mode>` of a mode's run over a period; empty without a run.

    A target of a rewind gets a block `rest_<mode>` too, a run over `work.rest`.
    """
    if mode.run is None:
        return {}
    if mode.name not in rollback_targets(automaton):
        return {f"run_{mode.name}": run_block(automaton, mode.run)}
    assert automaton.period is not None
    period = Assign(REMAINING_TIME.name, real(automaton.period), f"{automaton.name} {mode.run.key}")
    return {
        f"rest_{mode.name}": run_block(automaton, mode.run, REMAINING_TIME),
        f"run_{mode.name}": (period, RunBlock(f"rest_{mode.name}")),
    }


def rollback_bindings(automaton: Automaton, now: NameBindings) -> dict[str, Expr]:
    """Return a copy of the bindings in which recorded inputs are those at the crossing.

    They are `work.past_<name>`; all other names are as in `now`.
    """
    return {
        **now,
        **{name: recorded_input_ref(automaton, name) for name in recorded_inputs(automaton)},
    }


def rollback_equation_bindings(rollback: Rollback) -> dict[str, Expr]:
    """Return the variables `work.past_<name>` of the equations that exit and reset read, by name.

    Equations that these read in turn are included; the values are those at the crossing.
    """
    known = equation_formulas(rollback.source)
    names = equation_closure(rollback.source, rollback.names_read_by_jump)
    return {name: Ref(f"work.past_{name}", known[name][0].is_integer) for name in names}


def advance_from_crossing(rollback: Rollback) -> Block:
    """Return the operations that run the target from the crossing to the present.

    First comes the rest of the tick of the crossing (not for a source without a flow), then each
    later tick with its recorded inputs. If nothing was rolled back they do nothing.
    """
    automaton = rollback.automaton
    target = automaton.target_mode(rollback.transition)
    ops: list[Op] = []
    if rollback.flow_mode is not None:
        ops.append(
            Branch(Compare(">", REMAINING_TIME, real(0.0)), (RunBlock(f"rest_{target.name}"),))
        )
    place = set_history_index(automaton, subtract(subtract(TICKS_BACK, integer(2)), LOOKBACK_INDEX))
    inputs = load_recorded_run_inputs(automaton)
    later: Block = (
        *((*place, *inputs) if inputs else ()),
        RunBlock(f"run_{target.name}"),
    )
    is_later = Compare("<", add(LOOKBACK_INDEX, integer(1)), TICKS_BACK)
    if rollback.max_ticks > 1:
        ops.append(Loop(rollback.max_ticks - 1, LOOKBACK_INDEX.name, (Branch(is_later, later),)))
    return (Branch(Compare(">", TICKS_BACK, integer(0)), tuple(ops)),) if ops else ()


def rollback_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of rollbacks; `finalise_program` removes the unused ones.

    They are those of the tick history, of the search and of equations at the crossing.
    """
    return [
        *tick_history_variables(automaton),
        Variable(TICKS_BACK.name, "whole"),
        Variable(LOOKBACK_INDEX.name, "whole"),
        Variable(IS_UNTIL_TRUE.name, "truth"),
        Variable(
            REMAINING_TIME.name, "real", "s", about="from the crossing to the end of its tick"
        ),
        *equation_variables(automaton, "work.past_"),
    ]


def _until_block(rollback: Rollback, now: NameBindings) -> Block:
    """Return the block that evaluates `until` at `work.at_<state>` with `work.past_<input>`."""
    known = rollback_bindings(rollback.automaton, now)
    known.update({name: Ref(f"work.at_{name}") for name in rolled_back_states(rollback.automaton)})
    until, prefix = rollback.rewind.until, f"{rollback.automaton.name} "
    ops = lower_equations(rollback.source, known, "work.past_", prefix, until.reads)
    return (
        *ops,
        Assign(IS_UNTIL_TRUE.name, lower_expression(until.tree, known), prefix + until.key),
    )


def _rollback_block(rollback: Rollback, now: NameBindings) -> Block:
    """Return the block that moves the states to the crossing and evaluates equations there.

    The equations are those that the exit and the reset of the transition read.
    """
    automaton = rollback.automaton
    fault: Block = (FaultBit(REWIND_LIMIT),) if rollback.rewind.is_fault else ()
    limit: Block = (*fault, *load_current_inputs(automaton, "past"))
    known, prefix = rollback_bindings(automaton, now), f"{automaton.name} "
    there = lower_equations(
        rollback.source, known, "work.past_", prefix, rollback.names_read_by_jump
    )
    return (
        *_search_crossing_tick(rollback),
        Branch(Compare(">", TICKS_BACK, integer(0)), _locate_crossing(rollback), limit),
        *there,
    )


def _search_crossing_tick(rollback: Rollback) -> Block:
    """Return the search from the present backwards for the latest tick with `until` false.

    `work.ticks_back` becomes the number of ticks back: 0 if none is found, or if `until` is
    false at present.
    """
    automaton, until = rollback.automaton, RunBlock(f"until_{rollback.block_suffix}")
    is_wanted = Binary(
        "and", Compare("==", TICKS_BACK, integer(0)), Compare("<", LOOKBACK_INDEX, HISTORY_LENGTH)
    )
    look: Block = (
        *set_history_index(automaton, LOOKBACK_INDEX),
        *load_recorded_states(automaton, "at"),
        *load_recorded_inputs(automaton, "past"),
        until,
        Branch(
            Unary("not", IS_UNTIL_TRUE), (Assign(TICKS_BACK.name, add(LOOKBACK_INDEX, integer(1))),)
        ),
    )
    search = Loop(rollback.max_ticks, LOOKBACK_INDEX.name, (Branch(is_wanted, look),))
    now = (*load_current_states(automaton, "at"), *load_current_inputs(automaton, "past"))
    return (*now, until, Assign(TICKS_BACK.name, integer(0)), Branch(IS_UNTIL_TRUE, (search,)))


def _locate_crossing(rollback: Rollback) -> Block:
    """Return the operations that set the states to the crossing after the tick found."""
    automaton = rollback.automaton
    ring = (
        *set_history_index(automaton, subtract(TICKS_BACK, integer(2))),
        *load_recorded_states(automaton, "after"),
        *load_recorded_inputs(automaton, "after"),
    )
    now = (*load_current_states(automaton, "after"), *load_current_inputs(automaton, "after"))
    ops: list[Op] = [Branch(Compare("==", TICKS_BACK, integer(1)), now, ring)]
    there = [
        Assign(f"state.{name}", Ref(f"work.at_{name}")) for name in rolled_back_states(automaton)
    ]
    if rollback.flow_mode is None:
        return (*ops, *_use_tick_after(automaton), *there)
    before, held = _saturate_at_crossing(rollback, rollback.flow_mode)
    return (*ops, *_flow_to_crossing(rollback), *before, *there, *held)


def _saturate_at_crossing(rollback: Rollback, flow: str) -> tuple[Block, Block]:
    """Return the operations before and after the states are set to the crossing.

    They hold the states that vary in the flow in their ranges, as after a segment of a run (rule
    18).
    """
    automaton = rollback.automaton
    run = automaton.target_mode(rollback.transition).run
    assert automaton.model and run
    return saturate_moved_states(automaton, run.method, varying_states(automaton.model, flow))


def _use_tick_after(automaton: Automaton) -> list[Op]:
    """Return the operations that make the tick after the one found the crossing.

    They apply if no flow leads to the crossing, or if a correction of the observer caused it.
    """
    ops: list[Op] = [
        Assign(f"work.at_{name}", Ref(f"work.after_{name}"))
        for name in rolled_back_states(automaton)
    ]
    for name in recorded_inputs(automaton):
        ops.append(
            Assign(
                recorded_input_ref(automaton, name).name,
                recorded_input_ref(automaton, name, "after"),
            )
        )
    return [*ops, Assign(REMAINING_TIME.name, real(0.0))]


def _flow_to_crossing(rollback: Rollback) -> list[Op]:
    """Return one step of the flow of the source and, if `until` crosses in it, the bisection."""
    automaton = rollback.automaton
    assert automaton.period is not None
    names = rolled_back_states(automaton)
    ends = [Assign(f"work.at_{name}", Ref(f"work.end_{name}")) for name in names]
    crossing: Block = (RunBlock(f"series_{rollback.flow_mode}"), *_bisect_crossing(rollback), *ends)
    return [
        *(Assign(f"state.{name}", Ref(f"work.at_{name}")) for name in names),
        *_set_run_inputs(automaton),
        Assign("work.h", real(automaton.period)),
        RunBlock(f"step_{rollback.flow_mode}"),
        *ends,
        RunBlock(f"until_{rollback.block_suffix}"),
        Branch(IS_UNTIL_TRUE, crossing, tuple(_use_tick_after(automaton))),
    ]


def _bisect_crossing(rollback: Rollback) -> list[Op]:
    """Return the operations that halve (low, high]: `until` holds at high and not at low.

    The upper end is taken; `work.rest` becomes the time from there to the end of the tick.
    """
    low, high = Ref("work.low"), Ref("work.high")
    names = rolled_back_states(rollback.automaton)
    keep = [Assign(f"work.end_{name}", Ref(f"work.at_{name}")) for name in names]
    middle = add(low, multiply(real(0.5), subtract(high, low)))
    body: Block = (
        Assign("work.s", middle),
        RunBlock("point"),
        RunBlock(f"until_{rollback.block_suffix}"),
        Branch(
            IS_UNTIL_TRUE,
            (Assign(high.name, Ref("work.s")), *keep),
            (Assign(low.name, Ref("work.s")),),
        ),
    )
    return [
        Assign(low.name, real(0.0)),
        Assign(high.name, Ref("work.h")),
        Loop(RUN_BISECTIONS, "work.halving", body),
        Assign(REMAINING_TIME.name, subtract(Ref("work.h"), high)),
    ]


def _set_run_inputs(automaton: Automaton) -> list[Op]:
    """Return the operations that copy the inputs at the crossing to `before.<name>` for runs."""
    return [
        Assign(f"before.{name}", recorded_input_ref(automaton, name))
        for name in run_inputs(automaton)
    ]
