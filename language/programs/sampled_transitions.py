"""The jump of a sampled automaton without nested modes: waits, choice, actions (rules 4b and 6)."""

from __future__ import annotations

from collections.abc import Mapping

from language.ir.analysis_cache import cache_on_owner
from language.ir.ops import (
    Assign,
    Block,
    Expr,
    Op,
    RunBlock,
    integer,
)
from language.ir.program import TransitionInfo, fired_variable, mode_variable
from language.lowering.action_stages import (
    bindings_of_target,
    bindings_of_targets,
    common_stages,
    lower_transition,
    select_blocks,
    transition_stages,
)
from language.lowering.edge_detection import reset_activation
from language.lowering.expressions import equation_bindings
from language.lowering.tick_history import Rollback
from language.lowering.transition_choice import choose_by_priority, lower_sampled_choice
from language.lowering.transition_metadata import infos_of_mode, start_run
from language.model.automaton import Automaton, Mode, Transition
from language.programs.rewind import (
    advance_from_crossing,
    rollback_bindings,
    rollback_equation_bindings,
)


def lower_sampled_jump(
    automaton: Automaton,
    mode: Mode,
    infos: tuple[TransitionInfo, ...],
    now: Mapping[str, Expr],
) -> Block:
    """Return the jump of a mode: edges, wait counters, then at most one transition (rules 3 and 4).

    With parallel regions the jump sets the fired-transition variable only; `lower_sampled_commit`
    performs the actions (rule 14). `now` are the bindings without equations.
    """
    known = {**now, **equation_bindings(automaton, "equation.")}
    own = infos_of_mode(automaton, mode, infos)
    choice = lower_sampled_choice(automaton, mode, known, own)
    fire: dict[int, Block] = {}
    for k, (transition, info) in enumerate(zip(mode.transitions, own, strict=True)):
        fire[k] = (Assign(fired_variable(mode.region), integer(info.number), info.key),)
        if not automaton.regions:
            fire[k] = _lower_transition(automaton, transition, infos, (now, known), fire[k])
    return (*choice.edges, *choice.counts, *choose_by_priority(mode, choice.enabled, fire))


def _lower_transition(
    automaton: Automaton,
    transition: Transition,
    infos: tuple[TransitionInfo, ...],
    bindings: tuple[Mapping[str, Expr], Mapping[str, Expr]],
    fired_ops: Block,
) -> Block:
    """Return the actions of a transition in an automaton without parallel regions (rule 6).

    A transition with `rewind` goes back to the crossing first and advances to the present
    afterwards. `bindings` are the present ones, without equations and with them.
    """
    target = automaton.target_mode(transition)
    now, known = bindings
    go_back: Block = ()
    advance: Block = ()
    if transition.rewind:
        source = automaton.source_mode(transition)
        rollback = Rollback(automaton, source, transition, transition.rewind)
        now = rollback_bindings(automaton, now)
        known = {**now, **rollback_equation_bindings(rollback)}
        go_back = (RunBlock(f"rollback_{rollback.block_suffix}"),)
        advance = advance_from_crossing(rollback)
    stages = transition_stages(automaton, transition)
    moved = (*_switch_mode(automaton, transition, infos), *fired_ops, *start_run(automaton, target))
    read = bindings_of_target(automaton, target, now, known)
    return (*go_back, *lower_transition(automaton, stages, read, moved), *advance)


def lower_sampled_commit(
    automaton: Automaton,
    infos: tuple[TransitionInfo, ...],
    now: Mapping[str, Expr],
    evaluate_equations: Op,
) -> Block:
    """Return the actions of the transitions that the regions have selected (rule 6).

    They are exits, resets, changes of mode (with timers and runs) and entries; each stage of all
    regions reads one snapshot. `evaluate_equations` evaluates the equations of the new modes. `now`
    are the bindings without equations.
    """
    numbers = {info.key: info.number for info in infos}
    selected = [
        (each, (fired_variable(each.region), numbers[f"{automaton.name} {each.key}"]))
        for each in automaton.all_transitions
    ]
    moved = select_blocks(
        (
            selection,
            (
                *_switch_mode(automaton, each, infos),
                *start_run(automaton, automaton.target_mode(each)),
            ),
        )
        for each, selection in selected
    )
    read = bindings_of_targets(automaton, now, evaluate_equations)
    return lower_transition(automaton, common_stages(automaton, selected), read, moved)


def _switch_mode(
    automaton: Automaton, transition: Transition, infos: tuple[TransitionInfo, ...]
) -> list[Op]:
    """Return the operations that clear counters, reset the activation memory and set the mode.

    A mode that some transition enters with `memory: continue` keeps its counters when it is left;
    they are cleared when another transition enters it (rule 4b).
    """
    source, target = automaton.source_mode(transition), automaton.target_mode(transition)
    ending = [] if _keeps_timers(automaton, source) else [*infos_of_mode(automaton, source, infos)]
    if transition.memory == "reset" and _keeps_timers(automaton, target):
        ending += infos_of_mode(automaton, target, infos)
    ops: list[Op] = [Assign(info.timer, integer(0)) for info in ending if info.timer]
    ops += reset_activation(automaton, source, target)
    mode = mode_variable("memory.mode", transition.region)
    ops.append(Assign(mode, integer(automaton.target_mode(transition).number)))
    return ops


def _keeps_timers(automaton: Automaton, mode: Mode) -> bool:
    """Return whether some transition enters a mode with `memory: continue`."""
    return (mode.region, mode.name) in _timer_keeping_targets(automaton)


@cache_on_owner
def _timer_keeping_targets(automaton: Automaton) -> frozenset[tuple[str, str]]:
    """Return the (region, mode) pairs that transitions with `memory: continue` enter."""
    return frozenset(
        (transition.region, transition.target)
        for transition in automaton.all_transitions
        if transition.memory == "continue"
    )
