"""Micro-steps of continuous automata, and of the model of a run in a tick (rules 3, 6 and 14).

Without parallel regions the transition that is chosen acts at once. Parallel regions all select on
one snapshot, then all act.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from language.integration.vector_field import (
    VectorField,
    bindings_at_point,
    set_target_mode,
    stage_bindings,
)
from language.ir.ops import Assign, Block, Expr, Op, RunBlock, integer
from language.lowering.action_stages import (
    common_stages,
    lower_transition,
    select_blocks,
    transition_stages,
)
from language.lowering.expressions import choose_by_mode
from language.lowering.transition_choice import choose_by_priority
from language.model.automaton import Mode, Transition


@dataclass(frozen=True)
class TransitionSelection:
    """The names and conditions by which a micro-step selects transitions.

    `selected_variable` gives the variable of a region, `number_of` the number of a transition.
    `enabled` gives the conditions of the transitions of a mode by their index; `after_switch` gives
    further operations after a transition has switched the mode.
    """

    block_prefix: str
    selected_variable: Callable[[str], str]
    number_of: Callable[[Transition], int]
    enabled: Callable[[Mode], Mapping[int, Expr]]
    after_switch: Callable[[Transition], Block]


def micro_step_blocks(field: VectorField, selection: TransitionSelection) -> dict[str, Block]:
    """Return `<prefix>_<mode>` of each mode: one micro-step while the mode of the chart is active.

    With parallel regions there are also `<prefix>_<region>_<mode>`, which select a transition of a
    mode, and `commit_<prefix>`, which performs the selected ones of all regions. The prefix
    separates the blocks of a run from those of its automaton.
    """
    automaton, prefix = field.automaton, selection.block_prefix
    if not automaton.regions:
        modes = automaton.modes.values()
        return {f"{prefix}_{mode.name}": _single_step(field, mode, selection) for mode in modes}
    blocks: dict[str, Block] = {}
    for region in automaton.regions:
        for mode in region.modes.values():
            chosen = _select_transition(mode, selection, field.key_prefix)
            blocks[f"{prefix}_{mode.label}"] = chosen
    blocks[f"commit_{prefix}"] = _commit_block(field, selection)
    for mode in automaton.modes.values():
        blocks[f"{prefix}_{mode.name}"] = _parallel_step(field, mode, selection)
    return blocks


def _single_step(field: VectorField, mode: Mode, selection: TransitionSelection) -> Block:
    """Return one micro-step of an automaton without parallel regions."""
    automaton = field.automaton
    fire = {
        k: lower_transition(
            automaton,
            transition_stages(automaton, transition),
            stage_bindings(field, [automaton.target_mode(transition)]),
            (set_target_mode(field, transition), *selection.after_switch(transition)),
        )
        for k, transition in enumerate(mode.transitions)
    }
    return choose_by_priority(mode, selection.enabled(mode), fire)


def _parallel_step(field: VectorField, mode: Mode, selection: TransitionSelection) -> Block:
    """Return one micro-step of all regions while `mode` of the chart is active.

    All selections are cleared; the mode and the active modes of its own parallel regions select;
    then `commit_<prefix>` runs.
    """
    regions = field.automaton.all_regions
    ops: list[Op] = [
        Assign(selection.selected_variable(region.name), integer(0)) for region in regions
    ]
    ops += _select_transition(mode, selection, field.key_prefix)
    for region in mode.parallel_regions:
        others = region.modes.values()
        cases: dict[str, Block] = {
            other.name: (RunBlock(f"{selection.block_prefix}_{other.label}"),) for other in others
        }
        ops.append(choose_by_mode(region, bindings_at_point(field), cases))
    return (*ops, RunBlock(f"commit_{selection.block_prefix}"))


def _select_transition(mode: Mode, selection: TransitionSelection, prefix: str) -> Block:
    """Return the operations that select the enabled transition with the smallest priority."""
    variable = selection.selected_variable(mode.region)
    taken: dict[int, Block] = {}
    for k, transition in enumerate(mode.transitions):
        number = integer(selection.number_of(transition))
        taken[k] = (Assign(variable, number, prefix + transition.key),)
    return choose_by_priority(mode, selection.enabled(mode), taken)


def _commit_block(field: VectorField, selection: TransitionSelection) -> Block:
    """Return the actions of the selected transitions: exits, resets, mode changes, entries.

    `in(...)` reads the source modes up to the entries.
    """
    automaton = field.automaton
    selected = [
        (each, (selection.selected_variable(each.region), selection.number_of(each)))
        for each in automaton.all_transitions
    ]
    moved = select_blocks(
        (by, (set_target_mode(field, each), *selection.after_switch(each))) for each, by in selected
    )
    read = stage_bindings(field, automaton.modes.values())
    return lower_transition(automaton, common_stages(automaton, selected), read, moved)
