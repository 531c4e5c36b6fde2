"""Parallel: a micro-step of regions side by side - all choose on one snapshot, then all act.

Semantics, rules 3 and 14. An automaton whose chart is its only region does without (`switch` in
language/field.py): it resets and enters at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from language.action import stage_of_regions
from language.declaration import Formula
from language.field import Field, all_known_at, at_state, enter, known_at
from language.lower import choice, equations, reads_of
from language.model import Mode, Transition
from language.operation import Assign, Block, Branch, Choose, Expr, Op, Run, whole
from language.region import by_priority, slot


@dataclass(frozen=True)
class Selection:
    """How a micro-step names what it takes: the variable of a region, and each transition's number.

    `enabled` is whether a transition may fire, given the ending of its guard's variables; `moved`
    is what else happens when it has fired.
    """

    verb: str
    taken: Callable[[str], str]
    number: Callable[[Transition], int]
    enabled: Callable[[Transition, str], Expr]
    moved: Callable[[Transition], Block]


def parallel_blocks(field: Field, selection: Selection) -> dict[str, Block]:
    """Return `<verb>_<region>_<mode>` of the regions beside the chart, and `commit_<verb>`.

    `verb` keeps those of a run apart from those of the automaton that runs.
    """
    blocks: dict[str, Block] = {}
    for region in field.automaton.regions:
        for mode in region.modes.values():
            blocks[f"{selection.verb}_{mode.label}"] = _choose(mode, selection, field.prefix)
    blocks[f"commit_{selection.verb}"] = _commit(field, selection)
    return blocks


def parallel_step(field: Field, mode: Mode, selection: Selection) -> Block:
    """Return one micro-step of all regions while a mode of the chart is active."""
    regions = field.automaton.all_regions
    ops: list[Op] = [Assign(selection.taken(region.name), whole(0)) for region in regions]
    ops += _choose(mode, selection, field.prefix)
    for region in mode.beside:
        others = region.modes.values()
        cases: dict[str, Block] = {
            other.name: (Run(f"{selection.verb}_{other.label}"),) for other in others
        }
        ops.append(choice(region, known_at(field), cases))
    return (*ops, Run(f"commit_{selection.verb}"))


def _choose(mode: Mode, selection: Selection, prefix: str) -> Block:
    """The enabled transition with the smallest priority."""
    ops: Block = ()
    for k, transition in reversed(by_priority(mode)):
        number = whole(selection.number(transition))
        taken = Assign(selection.taken(mode.region), number, prefix + transition.key)
        ops = (Branch(selection.enabled(transition, slot(mode.region, k)), (taken,), ops),)
    return ops


def _commit(field: Field, selection: Selection) -> Block:
    """What the regions have chosen, stage by stage; `in(...)` is of the source up to the entry."""
    automaton = field.automaton
    before = _stage(field, selection, lambda way: automaton.source(way).exit)
    resets = _stage(field, selection, lambda way: way.reset)
    if before and resets:
        before = (*before, *at_state(field))
    moved = []
    for region in automaton.all_regions:
        ways = [way for mode in region.modes.values() for way in mode.transitions]
        cases = [(selection.number(w), (enter(field, w), *selection.moved(w))) for w in ways]
        moved.append(Choose(selection.taken(region.name), tuple(cases)))
    after = _stage(field, selection, lambda way: automaton.target(way).entry)
    if after:
        after = (*at_state(field), *_equations_of_entries(field), *after)
    return (*before, *resets, *moved, *after)


def _stage(
    field: Field, selection: Selection, written: Callable[[Transition], Mapping[str, Formula]]
) -> Block:
    known, number = all_known_at(field), selection.number
    return stage_of_regions(field.automaton, selection.taken, number, written, known)


def _equations_of_entries(field: Field) -> Block:
    """The equations that entries read, of the new modes and after the reset."""
    automaton = field.automaton
    entries = [formula for mode in automaton.all_modes for formula in mode.entry.values()]
    wanted = reads_of(formula.tree for formula in entries)
    cases = []
    for mode in automaton.modes.values():
        ops = equations(mode, known_at(field), "work.at_", field.prefix, wanted)
        cases.append((mode.number, tuple(ops)))
    return (Choose(field.mode, tuple(cases)),) if any(block for _, block in cases) else ()
