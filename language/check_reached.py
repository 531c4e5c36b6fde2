"""Check of what is reached: modes that no chain of transitions enters."""

from __future__ import annotations

from language.check_chart import never_entered
from language.model import Automaton, Mode, Region
from language.order import unreached
from language.problem import Problems


def check_reached(automaton: Automaton, problems: Problems) -> None:
    """Warn of modes that are never entered."""
    for mode in _never_entered(automaton):
        problems.warning("unreached", mode.span, f"mode `{mode.name}` is never entered")


def _never_entered(automaton: Automaton) -> list[Mode]:
    """Return the modes that neither an initial mode nor a fault leads to."""
    if automaton.tree:
        return never_entered(automaton, automaton.tree)
    return [
        region.modes[name] for region in automaton.all_regions for name in _left(automaton, region)
    ]


def _left(automaton: Automaton, region: Region) -> list[str]:
    found = unreached(region.modes, region.initial)
    fault_mode = automaton.fault_mode
    if fault_mode is not None and fault_mode in region.modes:
        found = [name for name in found if name in unreached(region.modes, fault_mode)]
    return found
