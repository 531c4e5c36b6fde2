"""Check of balances: one for each state, both sides of one dimension."""

from __future__ import annotations

from language.balance import coefficient_of
from language.dimension import TypeChecker
from language.kind import ExprType
from language.model import Automaton, Mode
from language.problem import SpecError, suggest_name
from language.syntax import ErrorNode
from language.units import SECOND, Dimension, dimension_product


def check_flow(automaton: Automaton, mode: Mode, check: TypeChecker) -> None:
    """Report states of a mode of the chart that nothing balances, then its balances."""
    problems = check.problems
    if automaton.is_sampled:
        return
    beside = {
        balance.state
        for region in mode.parallel_regions
        for m in region.modes.values()
        for balance in m.flow.values()
    }
    for name, state in automaton.states.items():
        if name not in mode.flow and name not in beside:
            label = f"state `{name}` has no balance in mode `{mode.name}`"
            problems.error("missing", state.span, label, f"`der({name}) = 0` keeps it")
    check_balances(automaton, mode, check)


def check_balances(automaton: Automaton, mode: Mode, check: TypeChecker) -> None:
    """Report balances whose two sides differ, or of no state."""
    problems = check.problems
    for name, balance in mode.flow.items():
        if name not in automaton.states:
            hint = suggest_name(name, automaton.states)
            problems.error("name", balance.left.span, f"`{name}` is not a state", hint)
            continue
        with problems.collect_errors():
            if isinstance(balance.left, ErrorNode):
                continue
            factor = coefficient_of(balance.left, name)
            if isinstance(factor, SpecError):
                raise factor
            rate = dimension_product(automaton.states[name].unit.dimension, SECOND, -1)
            rate = Dimension(rate.powers, automaton.states[name].unit.dimension.angle)
            kind: ExprType | None = rate if factor is None else check.infer_type(factor)
            if factor is not None and isinstance(kind, Dimension):
                kind = dimension_product(kind, rate)
            if isinstance(kind, Dimension):
                check.check_quantity(balance.right, kind, f"the left side for {name}")
