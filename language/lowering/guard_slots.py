"""Positions of guards in the array of guard values of a mode."""

from __future__ import annotations

from language.ir.ops import Compare, Expr, Ref, integer
from language.ir.program import mode_variable
from language.ir.regions import CHART
from language.lowering.chart_activity import is_active
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Mode
from language.model.chart_paths import mode_paths


def guard_slot(region: str, index: int) -> str:
    """Return the ending of the variables of a mode's guard: `guard_0`, `guard_gap_0`."""
    return str(index) if region == CHART else f"{region.replace('.', '_')}_{index}"


@cache_on_owner
def guard_slots(mode: Mode) -> list[str]:
    """Return the endings of all guards that are watched while a mode of the chart is active."""
    own = [guard_slot(CHART, index) for index in range(len(mode.transitions))]
    return own + [
        guard_slot(r.name, index)
        for r in mode.parallel_regions
        for index in range(r.max_transitions)
    ]


@cache_on_owner
def all_guard_slots(automaton: Automaton) -> list[str]:
    """Return the endings of the guard variables of an automaton."""
    return [
        guard_slot(r.name, index)
        for r in automaton.all_regions
        for index in range(r.max_transitions)
    ]


def mode_bindings(automaton: Automaton, base: str, prefix: str = "") -> dict[str, Expr]:
    """Return what `in(region.mode)` is, and under `mode region` the variable that says it."""
    bindings: dict[str, Expr] = {}
    if automaton.statechart:
        for path, node in mode_paths(automaton.statechart).items():
            bindings[f"in {prefix}{path}"] = is_active(automaton.statechart, node, base)
    for region in automaton.all_regions:
        variable = Ref(mode_variable(base, region.name))
        bindings[f"mode {prefix}{region.name}"] = variable
        if automaton.statechart:
            continue
        for mode in region.modes.values():
            is_in = Compare("==", variable, integer(mode.number))
            bindings[f"in {prefix}{region.name}.{mode.name}"] = is_in
    return bindings
