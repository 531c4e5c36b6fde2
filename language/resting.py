"""Resting: states whose rate is 0 in a mode, as it is written or by an equation that is 0.

Nothing of them is computed, so they stay what they are to the last bit.
"""

from __future__ import annotations

from language.model import Automaton, Mode
from language.once import once
from language.region import sources
from language.syntax import Name, Number, Tree


@once
def resting(mode: Mode) -> frozenset[str]:
    """Return the states that rest in a mode of the chart."""
    flow = mode.flow.values()
    return frozenset(balance.state for balance in flow if _is_zero(mode, balance.right))


def moving(automaton: Automaton, mode: str) -> tuple[str, ...]:
    """Return the states that move in a mode, in the order of the file."""
    still = resting(automaton.modes[mode])
    return tuple(name for name in automaton.states if name not in still)


def movable(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that move in one mode at least."""
    still = frozenset(automaton.states).intersection(*map(resting, automaton.modes.values()))
    return tuple(name for name in automaton.states if name not in still)


def never_moving(automaton: Automaton) -> frozenset[str]:
    """Return the states that rest in all modes."""
    return frozenset(automaton.states).difference(movable(automaton))


def carried_on(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that a run writes: those that move, and those that a transition resets."""
    reset = {n for mode in automaton.all_modes for one in mode.transitions for n in one.reset}
    return tuple(n for n in automaton.states if n in movable(automaton) or n in reset)


def _is_zero(mode: Mode, tree: Tree) -> bool:
    match tree:
        case Number(value):
            return value == 0
        case Name(name):
            formulas = sources(mode).get(name, ())
            return bool(formulas) and all(_is_zero(mode, one.tree) for one in formulas)
    return False
