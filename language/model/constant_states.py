"""Resting: states whose rate is 0 in a mode, as it is written or by an equation that is 0.

Nothing of them is computed, so they stay what they are to the last bit.
"""

from __future__ import annotations

from language.expressions.syntax_tree import Name, NumberLiteral, SyntaxTree
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Mode
from language.model.region_queries import equation_formulas


@cache_on_owner
def constant_states(mode: Mode) -> frozenset[str]:
    """Return the states that rest in a mode of the chart."""
    flow = mode.flow.values()
    return frozenset(balance.state for balance in flow if _is_zero(mode, balance.right))


def varying_states(automaton: Automaton, mode: str) -> tuple[str, ...]:
    """Return the states that move in a mode, in the order of the file."""
    constant = constant_states(automaton.modes[mode])
    return tuple(name for name in automaton.states if name not in constant)


def ever_varying_states(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that move in one mode at least."""
    constant = frozenset(automaton.states).intersection(
        *map(constant_states, automaton.modes.values())
    )
    return tuple(name for name in automaton.states if name not in constant)


def never_varying_states(automaton: Automaton) -> frozenset[str]:
    """Return the states that rest in all modes."""
    return frozenset(automaton.states).difference(ever_varying_states(automaton))


def written_states(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that a run writes: those that move, and those that a transition resets."""
    reset = {n for mode in automaton.all_modes for one in mode.transitions for n in one.reset}
    return tuple(n for n in automaton.states if n in ever_varying_states(automaton) or n in reset)


def _is_zero(mode: Mode, tree: SyntaxTree) -> bool:
    match tree:
        case NumberLiteral(value):
            return value == 0
        case Name(name):
            formulas = equation_formulas(mode).get(name, ())
            return bool(formulas) and all(_is_zero(mode, one.tree) for one in formulas)
    return False
