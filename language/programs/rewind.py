"""Rewind: a transition that comes late is made where its `until` turned true, then carried on.

`back_<mode>_<place>` looks back from now for the latest tick at which `until` of a transition is
false: the crossing lies in the tick after it, on the flow of the source from the states and inputs
that were kept then, located by halvings. The micro-step is made there; the run of the target
carries the states over the rest of that tick and over each later one. Where `until` was true as far
back as is kept, or is false now, nothing is taken back and, unless it says otherwise, a fault bit
is set.
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
TICKS_BACK = Ref("work.back", is_integer=True)
"""How many ticks before now `until` was false, 0: not found."""
LOOKBACK_INDEX = Ref("work.look", is_integer=True)
IS_UNTIL_TRUE = Ref("work.until")
REMAINING_TIME = Ref("work.rest")


def rollback_blocks(automaton: Automaton, mode: Mode, now: NameBindings) -> dict[str, Block]:
    """Return the blocks of the transitions of a mode that go back; `now` has no equations."""
    found: dict[str, Block] = {}
    for rewinding in rollbacks_from(automaton, mode):
        found[f"until_{rewinding.block_suffix}"] = _until_block(rewinding, now)
        found[f"back_{rewinding.block_suffix}"] = _rollback_block(rewinding, now)
    return found


def advance_blocks(automaton: Automaton, mode: Mode) -> dict[str, Block]:
    """Return `run_<mode>`: its period; of what a rewind enters also `rest_<mode>`, a part of it."""
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
    """Return what names are where the micro-step is made, apart from equations."""
    return {
        **now,
        **{name: recorded_input_ref(automaton, name) for name in recorded_inputs(automaton)},
    }


def rollback_equation_bindings(rollback: Rollback) -> dict[str, Expr]:
    """Return the equations that exit and reset read, as they are there."""
    known = equation_formulas(rollback.source)
    names = equation_closure(rollback.source, rollback.names_read_by_jump)
    return {name: Ref(f"work.past_{name}", known[name][0].is_integer) for name in names}


def advance_from_crossing(rollback: Rollback) -> Block:
    """Return what the target's run does from the crossing to now."""
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
    """Return the variables of all of it; `finished` leaves out what is not used."""
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
    """Whether `until` holds at `work.at_<state>` with the inputs `work.past_<input>`."""
    known = rollback_bindings(rollback.automaton, now)
    known.update({name: Ref(f"work.at_{name}") for name in rolled_back_states(rollback.automaton)})
    until, prefix = rollback.rewind.until, f"{rollback.automaton.name} "
    ops = lower_equations(rollback.source, known, "work.past_", prefix, until.reads)
    return (
        *ops,
        Assign(IS_UNTIL_TRUE.name, lower_expression(until.tree, known), prefix + until.key),
    )


def _rollback_block(rollback: Rollback, now: NameBindings) -> Block:
    """Go back to where the micro-step is made, and evaluate what its exit and reset read there."""
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
    """From now backwards to the latest tick at which `until` is false."""
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
    """The point is at the tick before the crossing: put the states at the crossing."""
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
    """Return what stands before and after the states are put at the crossing: what moves there is
    held as after a segment of a run (rule 18), what rests is what it was at a tick.
    """
    automaton = rollback.automaton
    run = automaton.target_mode(rollback.transition).run
    assert automaton.model and run
    return saturate_moved_states(automaton, run.method, varying_states(automaton.model, flow))


def _use_tick_after(automaton: Automaton) -> list[Op]:
    """The crossing is the tick itself: no flow leads to it, or a correction made it."""
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
    """One step of the flow of the source from the tick before; where it crosses, halve it."""
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
    """Halve (low, high]: `until` holds at high, not at low; the upper end is kept."""
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
    """Put the inputs of the point where runs read those of the tick before."""
    return [
        Assign(f"before.{name}", recorded_input_ref(automaton, name))
        for name in run_inputs(automaton)
    ]
