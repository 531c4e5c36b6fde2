"""Check of range violations: warns of assigned values that can exceed the range of their target.

Only values that depend on inputs and parameters alone are checked, because inputs can have any
value in their ranges. The reachable values of states are unknown. Targets with `on_range`, a fault
or a fallback are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

from language.ir.number_type import round_to_type
from language.ir.ops import Binary, Compare, Expr, real
from language.lowering.expressions import WHOLE_TYPES, lower_assigned_value
from language.model.automaton import Automaton, Mode
from language.model.declaration import Formula, RangePolicy, State
from language.smt.query_engine import QueryEngine, Witness
from language.smt.symbolic_environment import GuardSnapshot
from language.text.diagnostic import Problems, SpecError

STATE_PREFIXES = ("state.", "discrete.", "memory.")
"""Prefixes of variables whose reachable values are unknown."""


def check_range_violations(
    automaton: Automaton, query_engine: QueryEngine, problems: Problems
) -> None:
    """Warn of assignments that can exceed the range of their target; the hint shows a witness.

    Examined are entry, exit, update and resets; resets of transitions with events or completions
    are left out. Targets are real, with a range and the default range policy. Values that read a
    state, a discrete variable or memory are skipped, as are those without a witness.
    """
    for mode in automaton.all_modes:
        for formulas, guard in _assignments(mode):
            for name, formula in formulas.items():
                target = automaton.state_variables.get(name)
                if target is None or not _is_checked(target):
                    continue
                try:
                    witness = _find_violation(automaton, mode, formula, guard, target, query_engine)
                except (KeyError, SpecError):
                    continue
                if witness:
                    verb = "may be" if witness.text else "is"
                    label = f"`{name}` {verb} past its range of {_format_range(target)} here"
                    at = f"at {witness.text} in SI; " if witness.text else ""
                    hint = f"{at}limit the value with `clip`, or widen the range"
                    problems.warning("past", formula.span, label, hint)


def _assignments(mode: Mode) -> Iterator[tuple[Mapping[str, Formula], Formula | None]]:
    """Yield the assignments of a mode with the guard that holds when they are executed.

    The guard is None for entry, exit and update. Resets of transitions with events or completions
    are left out.
    """
    for formulas in (mode.entry, mode.exit, mode.update):
        yield formulas, None
    for transition in mode.transitions:
        if not (transition.events or transition.is_completion):
            yield transition.reset, transition.when


def _is_checked(target: State) -> bool:
    """Return whether a variable is real, has a range and the default range policy."""
    return (
        target.range is not None and target.type == "real" and target.range_policy == RangePolicy()
    )


def _find_violation(
    automaton: Automaton,
    mode: Mode,
    formula: Formula,
    guard: Formula | None,
    target: State,
    query_engine: QueryEngine,
) -> Witness | None:
    """Return a witness at which a formula exceeds the range of its target.

    The result is None if there is none, if the query is undecided, or if the value depends on a
    state.
    """
    snapshot = GuardSnapshot(automaton, mode)
    conditions: list[Expr] = [snapshot.lower_expression(guard.tree)] if guard else []
    snapshot.lower_expression(formula.tree)
    value = lower_assigned_value(formula.tree, snapshot.bindings, target.type in WHOLE_TYPES)
    assert target.range
    low, high = (round_to_type(Fraction(bound), automaton.numbers) for bound in target.range)
    if any(
        name.startswith(STATE_PREFIXES)
        for name in query_engine.build_query(snapshot.path, [value]).names_read
    ):
        return None
    below, above = Compare("<", value, real(low)), Compare(">", value, real(high))
    answer = query_engine.answer(
        query_engine.build_query(snapshot.path, [*conditions, Binary("or", below, above)])
    )
    return answer if isinstance(answer, Witness) else None


def _format_range(target: State) -> str:
    """Return a range in the unit of its declaration as text."""
    assert target.range
    unit = target.unit
    low, high = (float((bound - unit.offset) / unit.factor) for bound in target.range)
    return f"{low:.4g} to {high:.4g} {'' if unit.text == '1' else unit.text}".rstrip()
