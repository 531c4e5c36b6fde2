"""Check of size: what would make a Program too large to be looked at."""

from __future__ import annotations

from language.model import Automaton
from language.problem import Problems

MAX_EQUATIONS = 100_000
"""Equations and balances of all modes: half of what a spec may have of keys and values."""
MAX_TRANSITIONS = 200
"""Transitions that leave a mode: in the Program and in C each is inside the one before it."""


def check_size(automaton: Automaton, problems: Problems) -> None:
    """What stands at the root holds in every mode: the Program has it once for each."""
    modes = automaton.all_modes
    before = len(problems.reported)
    held = sum(len(mode.equations) + len(mode.flow) for mode in modes)
    if held > MAX_EQUATIONS:
        label = f"the modes have {held} equations and balances, those of the root in each of them"
        problems.error("huge", automaton.span, label, f"at most {MAX_EQUATIONS} are checked")
    for mode in modes:
        if len(mode.transitions) > MAX_TRANSITIONS:
            label = f"mode `{mode.name}` has {len(mode.transitions)} transitions"
            problems.error("huge", mode.span, label, f"a mode has at most {MAX_TRANSITIONS}")
    if len(problems.reported) > before:
        problems.raise_if_errors()
