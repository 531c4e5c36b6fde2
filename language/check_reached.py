"""Check of what is reached: modes that no chain of transitions enters."""

from __future__ import annotations

from language.check_chart import never_entered
from language.model import Automaton, Mode, Region
from language.order import unreached
from language.problem import Problems


def check_reached(automaton: Automaton, problems: Problems) -> None:
    """Warn of modes that are never entered."""
    for mode in _never_entered(automaton, set()):
        problems.warning("unreached", mode.span, f"mode `{mode.name}` is never entered")


def check_behind(automaton: Automaton, silent: set[str], problems: Problems) -> None:
    """Warn of modes that only transitions which never fire lead to."""
    told = {mode.key for mode in _never_entered(automaton, set())}
    for mode in _never_entered(automaton, silent) if silent else ():
        if mode.key not in told:
            label = f"mode `{mode.name}` is never entered: what leads to it never fires"
            problems.warning("unreached", mode.span, label)


def _never_entered(automaton: Automaton, silent: set[str]) -> list[Mode]:
    """Return the modes that neither an initial mode nor a fault leads to."""
    if automaton.tree:
        return never_entered(automaton, automaton.tree, silent)
    return [
        region.modes[name]
        for region in automaton.all_regions
        for name in _left(automaton, region, silent)
    ]


def _left(automaton: Automaton, region: Region, silent: set[str]) -> list[str]:
    found = unreached(region.modes, region.initial, silent)
    fault_mode = automaton.fault_mode
    if fault_mode is not None and fault_mode in region.modes:
        found = [name for name in found if name in unreached(region.modes, fault_mode, silent)]
    return found
