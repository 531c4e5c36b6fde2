"""Micro-steps of parallel regions: all select on one snapshot, then all act (rules 3 and 14).

An automaton without regions beside its chart uses `lower_single_region_step` of
language/integration/vector_field.py instead, which resets and enters at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from language.integration.vector_field import (
    VectorField,
    bindings_at_point,
    set_target_mode,
    stage_bindings,
)
from language.ir.ops import Assign, Block, Expr, Op, RunBlock, integer
from language.lowering.action_stages import common_stages, lower_transition, select_blocks
from language.lowering.expressions import choose_by_mode
from language.lowering.guard_variable_names import guard_slot
from language.lowering.transition_choice import choose_by_priority
from language.model.automaton import Mode, Transition
from language.model.region_queries import transitions_of_regions


@dataclass(frozen=True)
class TransitionSelection:
    """The names and conditions by which a micro-step selects transitions.

    `selected_variable` gives the variable of a region, `number_of` the number of a transition.
    `enabled_condition` gives the condition of a transition from the slot of its guard;
    `after_switch` gives further operations after the transition has switched the mode.
    """

    block_prefix: str
    selected_variable: Callable[[str], str]
    number_of: Callable[[Transition], int]
    enabled_condition: Callable[[Transition, str], Expr]
    after_switch: Callable[[Transition], Block]


def parallel_blocks(field: VectorField, selection: TransitionSelection) -> dict[str, Block]:
    """Return `<prefix>_<region>_<mode>` of the parallel regions, and `commit_<prefix>`.

    The former select a transition of a mode, the latter performs the selected ones of all regions.
    The prefix of the selection separates the blocks of a run from those of its automaton.
    """
    blocks: dict[str, Block] = {}
    for region in field.automaton.regions:
        for mode in region.modes.values():
            blocks[f"{selection.block_prefix}_{mode.label}"] = _select_transition(
                mode, selection, field.key_prefix
            )
    blocks[f"commit_{selection.block_prefix}"] = _commit_block(field, selection)
    return blocks


def lower_parallel_step(field: VectorField, mode: Mode, selection: TransitionSelection) -> Block:
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
    enabled: dict[int, Expr] = {}
    taken: dict[int, Block] = {}
    for k, transition in enumerate(mode.transitions):
        variable, number = selection.selected_variable(mode.region), selection.number_of(transition)
        enabled[k] = selection.enabled_condition(transition, guard_slot(mode.region, k))
        taken[k] = (Assign(variable, integer(number), prefix + transition.key),)
    return choose_by_priority(mode, enabled, taken)


def _commit_block(field: VectorField, selection: TransitionSelection) -> Block:
    """Return the actions of the selected transitions: exits, resets, mode changes, entries.

    `in(...)` reads the source modes up to the entries.
    """
    automaton = field.automaton
    selected = [
        (each, (selection.selected_variable(each.region), selection.number_of(each)))
        for each in transitions_of_regions(automaton)
    ]
    moved = select_blocks(
        (by, (set_target_mode(field, each), *selection.after_switch(each))) for each, by in selected
    )
    read = stage_bindings(field, automaton.modes.values())
    return lower_transition(automaton, common_stages(automaton, selected), read, moved)
