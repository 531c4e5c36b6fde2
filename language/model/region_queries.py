"""Region: what parallel regions give to a mode of the chart - names, guards, sources (rule 14).

All regions read one snapshot. An equation may stand in the modes of any one region; while a mode
of the chart is active, those of the regions beside it are chosen by the region's own mode.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping

from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Balance, Mode, Region, Transition
from language.model.declaration import Formula


def equation_names(mode: Mode) -> list[str]:
    """Return the names of the equations that hold while a mode is active."""
    return list(equation_formulas(mode))


@cache_on_owner
def equation_formulas(mode: Mode) -> dict[str, tuple[Formula, ...]]:
    """Return each equation's formulas: one, or those of the modes of a region beside."""
    formulas: dict[str, tuple[Formula, ...]] = {}
    formulas.update({name: (formula,) for name, formula in mode.equations.items()})
    for region in mode.parallel_regions:
        for name in region_equations(region):
            modes = region.modes.values()
            formulas[name] = tuple(m.equations[name] for m in modes if name in m.equations)
    return formulas


@cache_on_owner
def region_equations(region: Region) -> list[str]:
    """Return the names that the modes of a region define."""
    return list(dict.fromkeys(name for mode in region.modes.values() for name in mode.equations))


def region_of_equation(mode: Mode, name: str) -> Region | None:
    """Return the region beside a mode that defines an equation, None for the mode's own."""
    if name in mode.equations:
        return None
    return next(region for region in mode.parallel_regions if name in region_equations(region))


def region_of_balance(mode: Mode, state: str) -> Region | None:
    """Return the region beside a mode that balances a state, None for the mode's own."""
    if state in mode.flow:
        return None
    modes_of = {region.name: region.modes.values() for region in mode.parallel_regions}
    return next(r for r in mode.parallel_regions if any(state in m.flow for m in modes_of[r.name]))


def possible_balances(mode: Mode) -> Iterator[Balance]:
    """Yield every balance that may hold while a mode of the chart is active."""
    yield from mode.flow.values()
    for region in mode.parallel_regions:
        for other in region.modes.values():
            yield from other.flow.values()


def watched_transitions(mode: Mode) -> Iterator[Transition]:
    """Yield every transition that may be watched while a mode of the chart is active."""
    yield from mode.transitions
    for region in mode.parallel_regions:
        for other in region.modes.values():
            yield from other.transitions


@cache_on_owner
def transitions_by_priority(mode: Mode) -> list[tuple[int, Transition]]:
    """Return the transitions of a mode with their index, the smallest priority first (rule 3a)."""
    pairs = list(enumerate(mode.transitions))
    return sorted(pairs, key=lambda pair: (pair[1].priority or 0, pair[0]))


def one_configuration(automaton: Automaton, transition: Transition) -> Mode:
    """Return the source of a transition as a mode that has the equations of all other regions.

    Of another region its initial mode counts; for a search of witnesses, which prove nothing.
    """
    source = automaton.source_mode(transition)
    found: dict[str, Formula] = {}
    for region in automaton.all_regions:
        own = region.name == transition.region
        mode = source if own else region.modes[region.initial]
        found.update(mode.equations)
    return dataclasses.replace(source, equations=found, parallel_regions=())


def attach_regions(modes: Mapping[str, Mode], regions: tuple[Region, ...]) -> dict[str, Mode]:
    """Return the modes of the chart with the regions that run beside them."""
    return {
        name: dataclasses.replace(mode, parallel_regions=regions) for name, mode in modes.items()
    }


def equation_closure(mode: Mode, names: Iterable[str]) -> set[str]:
    """Return the equations of a mode that the wanted names need."""
    needed: set[str] = set()
    known = equation_formulas(mode)
    stack = [name for name in names if name in known]
    while stack:
        name = stack.pop()
        if name not in needed:
            needed.add(name)
            stack += [r for formula in known[name] for r in formula.reads if r in known]
    return needed
