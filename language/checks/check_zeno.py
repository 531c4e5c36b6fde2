"""Zeno check: finds cycles of modes that repeat infinitely often in a finite time (rule 12).

The check searches a Zeno equilibrium (Lamperski and Ames, IEEE TAC 58 (2013), section III): a point
at which the flow of each mode of the cycle enables the next guard at once and the resets change no
state. A bouncing ball has one at rest; a thermostat with a single limit has one at that limit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress

from language.checks.check_instant_cycles import Cycle, format_cycle, instant_transitions
from language.expressions.syntax_tree import NEGATED_RELATION, FunctionCall, names, walk
from language.ir.ops import Binary, Call, Compare, Expr, Ref, Unary, Value, multiply, real, subtract
from language.model.automaton import Automaton, Transition
from language.model.region_queries import earlier_by_priority
from language.smt.lie_derivative import LieDerivative, UnknownRateError
from language.smt.query import SolverQuery
from language.smt.query_engine import QueryEngine, Witness
from language.smt.symbolic_environment import GuardSnapshot, SymbolicPath
from language.text.diagnostic import Problems, SpecError

TIMED_FUNCTIONS = ("after", "every", "rising", "falling", "changed", "delay")
"""Functions whose guards need elapsed time or an earlier instant."""
EQUALITY_TOLERANCE = 1.0e-9
"""Relative tolerance of equalities: z3 solves them exactly, and the solution is rounded."""
SECANT_STEP = 1.0e-3
"""Relative distance from the equilibrium at which resets are evaluated for a secant."""


def check_zeno(automaton: Automaton, query_engine: QueryEngine, problems: Problems) -> None:
    """Warn of cycles of one or two modes that have a Zeno equilibrium; the warning shows it.

    Only continuous automata without parallel regions are examined, and transitions without a wait
    whose guard calls none of TIMED_FUNCTIONS. The resets must reduce the distance to the
    equilibrium. Cycles that cannot be lowered or differentiated, or that the solver leaves open,
    are skipped.
    """
    for cycle in _two_mode_cycles(automaton):
        try:
            witness = _find_zeno_equilibrium(automaton, cycle, query_engine)
        except (KeyError, SpecError, UnknownRateError):
            continue
        if witness:
            label = "here the modes can change infinitely often in a finite time: "
            label += format_cycle(cycle)
            hint = f"at {witness.text} each flow leads back at once; "
            hint += "leave a distance between the limits (a hysteresis), or let one of them wait"
            problems.warning("zeno", cycle[0].when.span, label, hint)


def _two_mode_cycles(automaton: Automaton) -> Iterator[Cycle]:
    """Yield self-transitions and pairs of opposite transitions that need no time.

    There are none in a sampled automaton or in one with parallel regions.
    """
    if automaton.is_sampled or automaton.regions:
        return
    untimed = [each for each in instant_transitions(automaton) if not _is_timed(each)]
    for position, first in enumerate(untimed):
        if first.source == first.target:
            yield (first,)
            continue
        for second in untimed[position + 1 :]:
            if (first.source, first.target) == (second.target, second.source):
                yield first, second


def _is_timed(transition: Transition) -> bool:
    """Return whether a guard calls one of `TIMED_FUNCTIONS`."""
    parts = (part for part in walk(transition.when.tree) if isinstance(part, FunctionCall))
    return any(part.function in TIMED_FUNCTIONS for part in parts)


def _find_zeno_equilibrium(
    automaton: Automaton, cycle: Cycle, query_engine: QueryEngine
) -> Witness | None:
    """Return a Zeno equilibrium of a cycle.

    None if none is found or the resets are not contracting. At the equilibrium each guard is
    enabled at once along the flow of its mode, no transition of a smaller priority is, and no reset
    changes a state or a discrete variable that the guards read. z3 solves the exact conditions; the
    witness is confirmed with equalities relaxed to a tolerance.
    """
    path = SymbolicPath()
    start = snapshot = GuardSnapshot(automaton, automaton.source_mode(cycle[0]), path)
    exact: list[Expr] = []
    relaxed: list[Expr] = []
    assigned: dict[str, Expr] = {}
    kept = [*automaton.states, *_discrete_names_read(automaton, cycle)]
    for transition in cycle:
        guard = snapshot.lower_expression(transition.when.tree)
        becoming = _EnablingCondition(snapshot)
        exact.append(becoming.condition_for(guard, True))
        relaxed.append(_relax_equalities(exact[-1]))
        others = _exclude_urgent_transitions(becoming, transition)
        exact += others
        relaxed += others
        after = snapshot.apply_transition(transition)
        for state in kept:
            if after.bindings[state] != start.bindings[state]:
                known = start.bindings[state]
                if isinstance(known, Ref) and state in automaton.states:
                    assigned[known.name] = after.bindings[state]
                same = Compare("==", after.bindings[state], start.bindings[state])
                exact.append(same)
                is_real = automaton.state_variables[state].type == "real"
                relaxed.append(_relax_equalities(same) if is_real else same)
        snapshot = after
    witness = query_engine.find_confirmed_witness(
        query_engine.build_query(path, exact), query_engine.build_query(path, relaxed)
    )
    return (
        witness
        if witness and _is_contracting(assigned, query_engine.build_query(path, relaxed), witness)
        else None
    )


def _exclude_urgent_transitions(becoming: _EnablingCondition, transition: Transition) -> list[Expr]:
    """Return the conditions that no transition of a smaller priority takes the place of another.

    A transition does so if its guard is true at once along the flow, or true and not false at once.
    Transitions with a wait do not, nor do those whose guards cannot be lowered or differentiated.
    """
    found: list[Expr] = []
    snapshot = becoming.snapshot
    for other in earlier_by_priority(snapshot.mode, transition):
        if other not in instant_transitions(snapshot.automaton):
            continue
        with suppress(KeyError, SpecError, UnknownRateError):
            guard = snapshot.lower_expression(other.when.tree)
            begins, ends = (becoming.condition_for(guard, truth) for truth in (True, False))
            stays = Binary("and", guard, Unary("not", ends))
            found.append(Unary("not", Binary("or", begins, stays)))
    return found


def _discrete_names_read(automaton: Automaton, cycle: Cycle) -> list[str]:
    """Return the discrete variables that the guards of a cycle read, also through equations."""
    found: set[str] = set()
    for transition in cycle:
        equations = automaton.source_mode(transition).equations
        pending = {name.path for name in names(transition.when.tree)}
        seen: set[str] = set()
        while pending:
            path = pending.pop()
            seen.add(path)
            if path in equations:
                pending |= {name.path for name in names(equations[path].tree)} - seen
        found |= seen
    return [name for name in automaton.discrete if name in found]


def _is_contracting(assigned: Mapping[str, Expr], query: SolverQuery, witness: Witness) -> bool:
    """Return whether every reset reduces the distance of its state to the equilibrium.

    The slope of the reset is a secant over `SECANT_STEP`. A bounce without loss of energy has slope
    1 and is not contracting.
    """
    for name, value in assigned.items():
        equilibrium = float(witness.valuation.get(name, 0.0))
        moved = equilibrium + SECANT_STEP * (1.0 + abs(equilibrium))
        beside = query.value_at({**witness.valuation, name: moved}, value)
        here = query.value_at(witness.valuation, value)
        if abs(beside - here) >= (1.0 - EQUALITY_TOLERANCE) * abs(moved - equilibrium):
            return False
    return True


class _EnablingCondition:
    """Conditions that are true now, or become true at once along the flow of a mode."""

    def __init__(self, snapshot: GuardSnapshot) -> None:
        self.snapshot = snapshot
        self.lie_derivative = LieDerivative(snapshot)

    def condition_for(self, condition: Expr, is_true: bool) -> Expr:
        """Return when a condition has a truth value now or at once along the flow.

        Relations are replaced by `_relation`; assigned names are expanded. Equalities and Boolean
        names are taken as they are.
        """
        match condition:
            case Unary("not", operand):
                return self.condition_for(operand, not is_true)
            case Binary("and" | "or" as operator, left, right):
                sides = self.condition_for(left, is_true), self.condition_for(right, is_true)
                return Binary("and" if (operator == "and") == is_true else "or", *sides)
            case Compare(operator, left, right) if operator not in ("==", "!="):
                relation = operator if is_true else NEGATED_RELATION[operator]
                return self._relation(relation, left, right)
            case Ref(name):
                assigned = next(
                    (v for target, v in self.snapshot.path.assignments if target == name), None
                )
                if assigned is not None:
                    return self.condition_for(assigned, is_true)
        return condition if is_true else Unary("not", condition)

    def _relation(self, operator: str, left: Expr, right: Expr) -> Expr:
        """Return when a relation holds now, or when both sides are equal and separate at once.

        The sides separate if the first derivative of the difference is positive, or if it is zero
        and the second is positive.
        """
        larger, smaller = (left, right) if operator in (">", ">=") else (right, left)
        now = Compare(">", larger, smaller)
        first = self.lie_derivative.differentiate(subtract(larger, smaller))
        zero = real(0.0)
        if isinstance(first, Value):
            return now
        moving: Expr = Compare(">", first, zero)
        second = self.lie_derivative.differentiate(first)
        if not isinstance(second, Value):
            begun = Binary("and", Compare("==", first, zero), Compare(">", second, zero))
            moving = Binary("or", moving, begun)
        return Binary("or", now, Binary("and", Compare("==", larger, smaller), moving))


def _relax_equalities(condition: Expr) -> Expr:
    """Return a condition with equalities of reals relaxed to a relative tolerance."""
    match condition:
        case Binary("and" | "or" as operator, left, right):
            return Binary(operator, _relax_equalities(left), _relax_equalities(right))
        case Compare("==", left, right) if not isinstance(left, Ref) or not left.is_integer:
            size = Binary("+", real(1.0), Call("abs", (right,)))
            difference = Call("abs", (subtract(left, right),))
            return Compare("<=", difference, multiply(real(EQUALITY_TOLERANCE), size))
    return condition
