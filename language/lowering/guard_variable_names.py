"""Guard variable names: the suffixes of the variables that hold the guards of the active modes."""

from __future__ import annotations

from language.ir.analysis_cache import cache_on_owner
from language.ir.ops import Compare, Expr, Ref, integer
from language.ir.program import mode_variable
from language.ir.root_region import CHART
from language.lowering.chart_activity import is_active
from language.model.automaton import Automaton, Mode
from language.model.chart_paths import mode_paths


def guard_slot(region: str, index: int) -> str:
    """Return the suffix of a guard: `<index>` in the chart, `<region>_<index>` in another region.

    `index` is that of the transition in its mode. The variables are `work.guard_<suffix>` and
    `memory.armed_<suffix>`.
    """
    return str(index) if region == CHART else f"{region.replace('.', '_')}_{index}"


@cache_on_owner
def guard_slots(mode: Mode) -> list[str]:
    """Return the suffixes of all guards that are watched while a mode of the chart is active.

    They are those of the mode itself, then those of its parallel regions. A parallel region has as
    many as its mode with the most transitions.
    """
    own = [guard_slot(CHART, index) for index in range(len(mode.transitions))]
    return own + [
        guard_slot(r.name, index)
        for r in mode.parallel_regions
        for index in range(r.max_transitions)
    ]


@cache_on_owner
def all_guard_slots(automaton: Automaton) -> list[str]:
    """Return the suffixes of the guard variables of all regions of an automaton.

    Each region has as many as its mode with the most transitions.
    """
    return [
        guard_slot(r.name, index)
        for r in automaton.all_regions
        for index in range(r.max_transitions)
    ]


def mode_bindings(automaton: Automaton, base: str, prefix: str = "") -> dict[str, Expr]:
    """Return the conditions `in <region>.<mode>` and the mode variables `mode <region>`, by key.

    `base` is the mode variable of the chart; `prefix` stands before the names of regions. In a
    chart with nested modes the conditions are `in <path>` for the paths of its nodes.
    """
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
