"""Check of what is reached: modes that no chain of transitions enters."""

from __future__ import annotations

from language.check_chart import unreachable_chart_modes
from language.model import Automaton, Mode, Region
from language.order import unreachable_modes
from language.problem import Problems


def check_reachability(automaton: Automaton, problems: Problems) -> None:
    """Warn of modes that are never entered."""
    for mode in _unreachable_modes(automaton, set()):
        problems.warning("unreached", mode.span, f"mode `{mode.name}` is never entered")


def check_blocked_modes(
    automaton: Automaton, dead_transitions: set[str], problems: Problems
) -> None:
    """Warn of modes that only transitions which never fire lead to."""
    reported = {mode.key for mode in _unreachable_modes(automaton, set())}
    for mode in _unreachable_modes(automaton, dead_transitions) if dead_transitions else ():
        if mode.key not in reported:
            label = f"mode `{mode.name}` is never entered: what leads to it never fires"
            problems.warning("unreached", mode.span, label)


def _unreachable_modes(automaton: Automaton, dead_transitions: set[str]) -> list[Mode]:
    """Return the modes that neither an initial mode nor a fault leads to."""
    if automaton.statechart:
        return unreachable_chart_modes(automaton, automaton.statechart, dead_transitions)
    return [
        region.modes[name]
        for region in automaton.all_regions
        for name in _unreachable_in_region(automaton, region, dead_transitions)
    ]


def _unreachable_in_region(
    automaton: Automaton, region: Region, dead_transitions: set[str]
) -> list[str]:
    found = unreachable_modes(region.modes, region.initial, dead_transitions)
    fault_mode = automaton.fault_mode
    if fault_mode is not None and fault_mode in region.modes:
        found = [
            name
            for name in found
            if name in unreachable_modes(region.modes, fault_mode, dead_transitions)
        ]
    return found
