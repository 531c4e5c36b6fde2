"""Region queries: the equations, balances and transitions of a mode and its parallel regions.

All regions read one snapshot (rule 14). An equation may be defined in the modes of one parallel
region only. While a mode of the region `chart` is active, the active mode of that parallel region
selects the formula.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping

from language.ir.analysis_cache import cache_on_owner
from language.model.automaton import Balance, Mode, Region, Transition
from language.model.declaration import Formula


def equation_names(mode: Mode) -> list[str]:
    """Return the names of the equations that are defined while a mode is active, each once.

    These are the equations of the mode, then those of any mode of its parallel regions.
    """
    return list(equation_formulas(mode))


@cache_on_owner
def equation_formulas(mode: Mode) -> dict[str, tuple[Formula, ...]]:
    """Return the formulas of each equation that is defined while a mode is active.

    An equation of the mode itself has one formula; an equation of a parallel region has one formula
    for each mode of the region that defines it. Equations of the mode come first, then the regions
    in their order.
    """
    formulas: dict[str, tuple[Formula, ...]] = {}
    formulas.update({name: (formula,) for name, formula in mode.equations.items()})
    for region in mode.parallel_regions:
        for name in region_equations(region):
            modes = region.modes.values()
            formulas[name] = tuple(m.equations[name] for m in modes if name in m.equations)
    return formulas


@cache_on_owner
def region_equations(region: Region) -> list[str]:
    """Return the names of the equations that the modes of a region define, each once.

    They are in the order of the modes and of their equations.
    """
    return list(dict.fromkeys(name for mode in region.modes.values() for name in mode.equations))


def region_of_equation(mode: Mode, name: str) -> Region | None:
    """Return the first parallel region of a mode with an equation, or None for the mode itself.

    The mode itself has precedence. Raises StopIteration if neither defines the equation.
    """
    if name in mode.equations:
        return None
    return next(region for region in mode.parallel_regions if name in region_equations(region))


def region_of_balance(mode: Mode, state: str) -> Region | None:
    """Return the first parallel region of a mode that balances a state; None for the mode itself.

    The mode itself has precedence. Raises StopIteration if neither has a balance of the state.
    """
    if state in mode.flow:
        return None
    modes_of = {region.name: region.modes.values() for region in mode.parallel_regions}
    return next(r for r in mode.parallel_regions if any(state in m.flow for m in modes_of[r.name]))


def possible_balances(mode: Mode) -> Iterator[Balance]:
    """Yield the balances of a mode, then those of all modes of its parallel regions.

    A state may occur in several of them.
    """
    yield from mode.flow.values()
    for region in mode.parallel_regions:
        for other in region.modes.values():
            yield from other.flow.values()


def watched_transitions(mode: Mode) -> Iterator[Transition]:
    """Yield the transitions of a mode, then those of all modes of its parallel regions."""
    yield from mode.transitions
    for region in mode.parallel_regions:
        for other in region.modes.values():
            yield from other.transitions


@cache_on_owner
def transitions_by_priority(mode: Mode) -> list[tuple[int, Transition]]:
    """Return pairs of index and transition of a mode, in ascending order of `priority` (rule 3a).

    The index is the position in `mode.transitions`. A transition without a priority has priority 0;
    equal priorities are in the order of the file.
    """
    pairs = list(enumerate(mode.transitions))
    return sorted(pairs, key=lambda pair: (pair[1].priority or 0, pair[0]))


def earlier_by_priority(mode: Mode, transition: Transition) -> list[Transition]:
    """Return the transitions of a mode that come before one of them by priority (rule 3a).

    Raises ValueError if the transition does not belong to the mode.
    """
    ordered = [other for _, other in transitions_by_priority(mode)]
    return ordered[: ordered.index(transition)]


def attach_regions(modes: Mapping[str, Mode], regions: tuple[Region, ...]) -> dict[str, Mode]:
    """Return copies of modes, by the same names, whose `parallel_regions` are `regions`."""
    return {
        name: dataclasses.replace(mode, parallel_regions=regions) for name, mode in modes.items()
    }


def equation_closure(mode: Mode, names: Iterable[str]) -> set[str]:
    """Return the names of the equations of a mode on which `names` depend, directly or indirectly.

    Equations of parallel regions and all their formulas count. The names themselves are included if
    they are equations; other names are ignored.
    """
    needed: set[str] = set()
    known = equation_formulas(mode)
    stack = [name for name in names if name in known]
    while stack:
        name = stack.pop()
        if name not in needed:
            needed.add(name)
            stack += [r for formula in known[name] for r in formula.reads if r in known]
    return needed
