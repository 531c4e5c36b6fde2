"""Constant states: states whose rate is zero in a mode.

A rate counts as zero if it is the literal 0 or an equation whose formulas are all 0. The
integration leaves out such states, so they keep their value bit for bit.
"""

from __future__ import annotations

from language.expressions.syntax_tree import Name, NumberLiteral, SyntaxTree
from language.ir.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Mode
from language.model.region_queries import equation_formulas


@cache_on_owner
def constant_states(mode: Mode) -> frozenset[str]:
    """Return the states whose balance in a mode itself has a right side of zero.

    Zero is the literal 0, or an equation whose formulas, those of parallel regions included, are
    all zero. States balanced in a parallel region are not constant.
    """
    flow = mode.flow.values()
    return frozenset(balance.state for balance in flow if _is_zero(mode, balance.right))


def varying_states(automaton: Automaton, mode: str) -> tuple[str, ...]:
    """Return the states that are not constant in the mode of a name, in the order of the file.

    The mode belongs to the region `chart`; raises KeyError for another name. States without a
    balance in the mode count as varying.
    """
    constant = constant_states(automaton.modes[mode])
    return tuple(name for name in automaton.states if name not in constant)


def ever_varying_states(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that vary in at least one mode of the region `chart`.

    A state varies in a mode unless it is one of its `constant_states`. They are in the order of the
    file.
    """
    constant = frozenset(automaton.states).intersection(
        *map(constant_states, automaton.modes.values())
    )
    return tuple(name for name in automaton.states if name not in constant)


def never_varying_states(automaton: Automaton) -> frozenset[str]:
    """Return the states that are constant in all modes of the region `chart`."""
    return frozenset(automaton.states).difference(ever_varying_states(automaton))


def written_states(automaton: Automaton) -> tuple[str, ...]:
    """Return the states that a simulation writes, in the order of the file.

    These are the states that vary in some mode of the region `chart` and the states that some exit,
    reset or entry, also of a superstate or a parallel region, assigns.
    """
    assigned = {n for mode in automaton.all_modes for part in mode.jump_assignments for n in part}
    varying = ever_varying_states(automaton)
    return tuple(n for n in automaton.states if n in varying or n in assigned)


def _is_zero(mode: Mode, tree: SyntaxTree) -> bool:
    """Tell whether an expression is the literal 0 or a name of equations that are all zero."""
    match tree:
        case NumberLiteral(value):
            return value == 0
        case Name(name):
            formulas = equation_formulas(mode).get(name, ())
            return bool(formulas) and all(_is_zero(mode, formula.tree) for formula in formulas)
    return False
