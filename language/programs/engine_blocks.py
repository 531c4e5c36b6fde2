"""Blocks of a continuous automaton that an engine runs one by one (continuous_program.py)."""

from __future__ import annotations

from language.integration.vector_field import (
    VectorField,
    run_block_by_mode,
    set_point_time,
    set_point_to_state,
    stage_bindings,
)
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Loop,
    Ref,
    RunBlock,
    Switch,
    Unary,
    Value,
    integer,
    real,
)
from language.lowering.action_stages import initial_stages, lower_transition
from language.lowering.constants import derive_block
from language.lowering.continuous_delay import (
    RECORD_AGE,
    ContinuousDelay,
    alarms_of,
    fill_block,
    record_block,
)
from language.lowering.continuous_edge_detection import reset_levels, store_levels
from language.lowering.expressions import NameBindings, equation_bindings
from language.lowering.guard_variable_names import guard_slots
from language.lowering.program_builder import clear_fired, enter_initial_modes, lower_initial_values
from language.model.automaton import Automaton, Mode
from language.programs.major_step import WaitTimers, begin_blocks, block_of_mode


def engine_blocks(
    field: VectorField, known: NameBindings, waits: WaitTimers, delays: tuple[ContinuousDelay, ...]
) -> dict[str, Block]:
    """Return the blocks that are run from outside, by name.

    They are `derive`, `init`, `start`, `equations`, `evaluate_guards`, `jump`, `flow`, `dense`,
    `peek` and, with delays, `record`. `known` are the bindings without equations. Other blocks,
    such as `jump_<mode>`, are run by name and not included.
    """
    automaton = field.automaton
    now = (*set_point_to_state(field), *set_point_time(field, real(0.0)))
    ends = [Assign(f"state.{name}", Ref(f"work.at_{name}")) for name in field.states]
    modes = automaton.modes.values()
    at_start = set_point_time(field, real(0.0))
    evaluate: Block = (*at_start, run_block_by_mode(field, "equations"))
    whole_known = {**known, **equation_bindings(automaton, "equation.")}
    # A delayed quantity may read another one, so each round completes at least one more delay.
    rounds = (*evaluate, *fill_block(delays, whole_known))
    fill: Block = (Loop(len(delays), "work.round", rounds),) if delays else ()
    keep: Block = (
        *evaluate,
        *record_block(delays, whole_known),
        Assign(RECORD_AGE.name, real(0.0)),
    )
    record = {"record": keep} if delays else {}
    guards_by_mode = tuple(
        (mode.number, _guard_block(automaton, mode)) for mode in automaton.modes.values()
    )
    return {
        "derive": derive_block(automaton),
        "init": (
            Assign("memory.started", Value(False)),
            *enter_initial_modes(automaton, "memory.mode"),
            Assign("memory.faults", integer(0)),
        ),
        "start": (*_start_block(field, known, waits, delays), *fill),
        "equations": evaluate,
        **record,
        "evaluate_guards": (
            *_clear_periodic_alarms(automaton),
            *now,
            Switch("memory.mode", guards_by_mode),
            RunBlock("restart_waits"),
        ),
        "jump": (*clear_fired(automaton), *now, run_block_by_mode(field, "jump")),
        "flow": (run_block_by_mode(field, "flow"),),
        "dense": (
            Switch(
                field.mode_variable_name, tuple((m.number, _dense_output_block(m)) for m in modes)
            ),
        ),
        "peek": (RunBlock("point"), *ends),
    }


def _start_block(
    field: VectorField, known: NameBindings, waits: WaitTimers, delays: tuple[ContinuousDelay, ...]
) -> Block:
    """Return the block `start`: start values, initial modes, timers and entries (rule 16b)."""
    automaton = field.automaton
    begins, initial = begin_blocks(waits), automaton.modes[automaton.initial]
    stages = initial_stages((0, r.modes[r.initial]) for r in automaton.all_regions)
    entries = lower_transition(automaton, stages, stage_bindings(field, [initial]))
    return (
        *lower_initial_values(automaton, known, field.key_prefix),
        *enter_initial_modes(automaton, "memory.mode"),
        *(wait.restart for wait in waits),
        *reset_levels(automaton),
        *(op for r in automaton.all_regions for op in block_of_mode(begins, r.modes[r.initial])),
        *((Assign(RECORD_AGE.name, real(0.0)),) if delays else ()),
        Assign("memory.time", real(0.0)),
        Assign("memory.started", Value(True)),
        *(set_point_to_state(field) if entries else ()),
        *entries,
    )


def _clear_periodic_alarms(automaton: Automaton) -> Block:
    """Return the assignments that clear the alarms of `every`, which last one instant."""
    repeating = [alarm for alarm in alarms_of(automaton) if alarm.repeats]
    return tuple(Assign(alarm.variable, Value(False)) for alarm in repeating)


def _dense_output_block(mode: Mode) -> Block:
    """Return the operation that fills the series of the last flow, unless it was filled before."""
    run: Block = (RunBlock(f"series_{mode.name}"),)
    is_known = Binary("or", Ref("work.crossed"), Ref("work.is_wait"))
    return (Branch(Unary("not", is_known), run),) if guard_slots(mode) else run


def _guard_block(automaton: Automaton, mode: Mode) -> Block:
    """Return the operations that evaluate and store the guards and levels of a mode."""
    armed = [
        Assign(f"memory.armed_{slot}", Ref(f"work.guard_{slot}")) for slot in guard_slots(mode)
    ]
    return (RunBlock(f"guards_{mode.name}"), *armed, *store_levels(automaton))
