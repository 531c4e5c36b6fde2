"""Parallel: a micro-step of regions side by side - all choose on one snapshot, then all commit.

Semantics, rules 3 and 14. An automaton whose chart is its only region does without (`switch` in
language/field.py): it resets and enters at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from language.field import Field, enter, known_at, resets
from language.lower import choice
from language.model import Mode, Region, Transition
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
    """Return `<verb>_<region>_<mode>` of the regions beside the chart, `commit_<verb>_<region>`.

    `verb` keeps those of a run apart from those of the automaton that runs.
    """
    blocks: dict[str, Block] = {}
    for region in field.automaton.regions:
        for mode in region.modes.values():
            blocks[f"{selection.verb}_{mode.label}"] = _choose(field, mode, selection)
    for region in field.automaton.all_regions:
        blocks[_commit_name(selection, region)] = (_commit(field, region, selection),)
    return blocks


def parallel_step(field: Field, mode: Mode, selection: Selection) -> Block:
    """Return one micro-step of all regions while a mode of the chart is active."""
    regions = field.automaton.all_regions
    ops: list[Op] = [Assign(selection.taken(region.name), whole(0)) for region in regions]
    ops += _choose(field, mode, selection)
    for region in mode.beside:
        others = region.modes.values()
        cases: dict[str, Block] = {
            other.name: (Run(f"{selection.verb}_{other.label}"),) for other in others
        }
        ops.append(choice(region, known_at(field), cases))
    return (*ops, *(Run(_commit_name(selection, region)) for region in regions))


def _commit_name(selection: Selection, region: Region) -> str:
    return f"commit_{selection.verb}_{region.name}"


def _choose(field: Field, mode: Mode, selection: Selection) -> Block:
    """The enabled transition with the smallest priority; its resets read the values before."""
    ops: Block = ()
    for k, transition in reversed(by_priority(mode)):
        taken = Assign(
            selection.taken(mode.region),
            whole(selection.number(transition)),
            field.prefix + transition.key,
        )
        enabled = selection.enabled(transition, slot(mode.region, k))
        ops = (Branch(enabled, (taken, *resets(field, transition)[0]), ops),)
    return ops


def _commit(field: Field, region: Region, selection: Selection) -> Choose:
    cases = []
    for mode in region.modes.values():
        for transition in mode.transitions:
            reset = resets(field, transition)[1]
            block = (*reset, enter(field, transition), *selection.moved(transition))
            cases.append((selection.number(transition), block))
    return Choose(selection.taken(region.name), tuple(cases))
