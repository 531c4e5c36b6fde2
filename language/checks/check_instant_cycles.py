"""Instantaneous cycles: finds transitions that repeat for ever at one instant (rules 7, 9 and 12).

Only continuous automata are checked here. A cycle is reported if it is taken twice from some values
and, from the same values, more often than the bound of micro-steps allows. A run that reaches these
values certainly stops.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import islice

from language.expressions.syntax_tree import Name, Relation, SyntaxTree, walk
from language.ir.analysis_cache import cache_on_owner
from language.ir.ops import Expr, Unary
from language.lowering.constants import wait_seconds
from language.lowering.event_tolerance import is_instantaneous
from language.model.automaton import Automaton, Transition
from language.model.graph_algorithms import strongly_connected_components
from language.model.region_queries import earlier_by_priority
from language.smt.bound_propagation import is_disproved_by_bounds
from language.smt.query_engine import QueryEngine, Witness
from language.smt.symbolic_environment import GuardSnapshot, SymbolicPath
from language.text.diagnostic import Problems, SpecError

MAX_CYCLE_LENGTH = 4
"""Largest number of transitions of a cycle that is searched."""
MAX_CYCLES = 200
"""Largest number of cycles of one automaton that are examined."""

Cycle = tuple[Transition, ...]
"""Transitions of a cycle; each leads to the source of the next, the last to that of the first."""


def check_short_cycles(automaton: Automaton, problems: Problems) -> None:
    """Report cycles of one or two transitions that repeat at one instant, with a witness.

    Only continuous automata have them. The error is placed at the guard of the last transition that
    compares a state by `<=` or `>=`, else at that of the last one.
    """
    for cycle, witness in _endless_cycles(automaton, range(1, 3)):
        label = f"this fires again at the same instant, for ever: {format_cycle(cycle)}"
        hint = f"{witness.hint_prefix}write the direction of motion too, like "
        hint += "`x >= limit and v > 0 m/s`" + _range_hint(automaton)
        problems.error("refire", _boundary_transition(automaton, cycle).when.span, label, hint)


def check_long_cycles(automaton: Automaton, problems: Problems) -> None:
    """Warn of cycles of three or more transitions that repeat at one instant, with a witness.

    They have at most MAX_CYCLE_LENGTH transitions. Only continuous automata have them. The place is
    that of `check_short_cycles`.
    """
    for cycle, witness in _endless_cycles(automaton, range(3, MAX_CYCLE_LENGTH + 1)):
        label = f"from here the modes change for ever at one instant: {format_cycle(cycle)}"
        hint = f"{witness.hint_prefix}let one of them wait, or its guard exclude the one before"
        hint += _range_hint(automaton)
        problems.warning("cycle", _boundary_transition(automaton, cycle).when.span, label, hint)


def _endless_cycles(automaton: Automaton, lengths: range) -> Iterator[tuple[Cycle, Witness]]:
    """Yield cycles of some lengths that repeat for ever, each with a witness.

    A cycle starts at its first transition from which this is shown. A sampled automaton has none
    here.
    """
    if automaton.is_sampled:
        return  # see language/checks/check_chart_cycles.py
    query_engine = QueryEngine(automaton)
    for members in instant_cycles(automaton):
        for start in range(len(members) if len(members) in lengths else 0):
            cycle = (*members[start:], *members[:start])
            witness = _find_endless_witness(automaton, cycle, query_engine)
            if witness:
                yield cycle, witness
                break


@cache_on_owner
def instant_cycles(automaton: Automaton) -> tuple[Cycle, ...]:
    """Return the cycles in which each transition can follow its predecessor at one instant.

    Transitions have no wait or a wait of 0. At most MAX_CYCLES cycles of at most MAX_CYCLE_LENGTH
    transitions are examined; a cycle is left out if one of its pairs is proven impossible or a
    guard cannot be lowered. Whether a whole cycle is possible is not examined. The result is cached
    on the automaton.
    """
    query_engine = QueryEngine(automaton)
    transitions = {each.key: each for each in instant_transitions(automaton)}
    after: dict[str, list[str]] = {key: [] for key in transitions}
    for first, seconds in _candidate_successors(automaton, list(transitions.values())):
        after[first.key] = [
            each.key for each in _feasible_successors(automaton, first, seconds, query_engine)
        ]
    follows: dict[tuple[str, str], bool] = {}
    cycles: list[Cycle] = []
    for members in islice(simple_cycles(after), MAX_CYCLES):
        cycle = tuple(transitions[key] for key in members)
        pairs = [
            (first, second) for first, second in zip(cycle, (*cycle[1:], cycle[0]), strict=True)
        ]
        for first, second in pairs:
            key = first.key, second.key
            if key not in follows:
                follows[key] = _can_follow(automaton, first, second, query_engine)
            if not follows[key]:
                break
        else:
            cycles.append(cycle)
    return tuple(cycles)


def instant_transitions(automaton: Automaton) -> list[Transition]:
    """Return the transitions of a continuous automaton without a wait, or with a wait of 0.

    A wait within the tolerance of rule 10 is 0.
    """
    return [
        transition
        for transition in automaton.all_transitions
        if is_instantaneous(automaton, wait_seconds(transition, automaton))
    ]


def simple_cycles(after: Mapping[str, list[str]]) -> Iterator[tuple[str, ...]]:
    """Yield the simple cycles of a graph with at most MAX_CYCLE_LENGTH nodes, each once.

    `after` gives the successors of each node; all nodes are keys. A cycle starts with its first
    node in the order of `after`; a node that follows itself is a cycle of one.
    """
    position = {name: number for number, name in enumerate(after)}
    for group in strongly_connected_components(after):
        inside = set(group)
        for start in group:
            stack: list[tuple[str, ...]] = [(start,)]
            while stack:
                path = stack.pop()
                for name in after[path[-1]]:
                    if name == start:
                        yield path
                    elif name in inside and position[name] > position[start] and name not in path:
                        stack += [(*path, name)] if len(path) < MAX_CYCLE_LENGTH else []


def _candidate_successors(
    automaton: Automaton, transitions: list[Transition]
) -> Iterator[tuple[Transition, list[Transition]]]:
    """Yield each transition with those that leave its target within the same component of modes.

    Components are the strongly connected components of the graph of modes; other transitions are in
    no cycle.
    """
    modes: dict[str, list[str]] = {f"{m.region} {m.name}": [] for m in automaton.all_modes}
    leaving: dict[str, list[Transition]] = {}
    for transition in transitions:
        modes[f"{transition.region} {transition.source}"].append(
            f"{transition.region} {transition.target}"
        )
        leaving.setdefault(f"{transition.region} {transition.source}", []).append(transition)
    groups = {
        name: number
        for number, group in enumerate(strongly_connected_components(modes))
        for name in group
    }
    for transition in transitions:
        target = f"{transition.region} {transition.target}"
        if groups[target] == groups[f"{transition.region} {transition.source}"]:
            seconds = [(f"{second.region} {second.target}", second) for second in leaving[target]]
            yield transition, [second for name, second in seconds if groups[name] == groups[target]]


def _feasible_successors(
    automaton: Automaton, first: Transition, successors: list[Transition], query_engine: QueryEngine
) -> Iterator[Transition]:
    """Yield the successors that linear bounds do not exclude at the same instant.

    Successors that cannot be lowered are left out.
    """
    snapshot = GuardSnapshot(automaton, automaton.source_mode(first))
    try:
        guard = snapshot.lower_expression(first.when.tree)
        successor = snapshot.apply_transition(first)
    except (KeyError, SpecError):
        return
    for second in successors:
        with suppress(KeyError, SpecError):
            condition = successor.lower_expression(second.when.tree)
            if not is_disproved_by_bounds(
                query_engine.build_query(snapshot.path, (guard, condition))
            ):
                yield second


def _can_follow(
    automaton: Automaton, first: Transition, second: Transition, query_engine: QueryEngine
) -> bool:
    """Return whether a transition may follow another one at the same instant.

    The result is False if it is proven impossible or a guard cannot be lowered.
    """
    try:
        path, guards = path_constraints(automaton, (first, second))
    except (KeyError, SpecError):
        return False
    return not query_engine.is_proven_unsatisfiable(query_engine.build_query(path, guards))


def path_constraints(automaton: Automaton, cycle: Cycle) -> tuple[SymbolicPath, list[Expr]]:
    """Return the symbolic path of consecutive transitions at one instant, and its conditions.

    Each guard holds at its position, and no guard of a smaller priority without wait in the same
    mode does. The effects of a transition apply before the guard of the next one. Raises KeyError
    or SpecError if a guard cannot be lowered.
    """
    path = SymbolicPath()
    snapshot = GuardSnapshot(automaton, automaton.source_mode(cycle[0]), path)
    needed: list[Expr] = []
    for position, transition in enumerate(cycle):
        for other in earlier_by_priority(snapshot.mode, transition):
            if not other.wait:
                needed.append(Unary("not", snapshot.lower_expression(other.when.tree)))
        needed.append(snapshot.lower_expression(transition.when.tree))
        if position + 1 < len(cycle):
            snapshot = snapshot.apply_transition(transition)
    return path, needed


def _find_endless_witness(
    automaton: Automaton, cycle: Cycle, query_engine: QueryEngine
) -> Witness | None:
    """Return values from which a cycle is taken more often than the bound of micro-steps.

    The result is None if there are none or if another region can interfere.
    """
    try:
        answer = query_engine.answer(
            query_engine.build_query(*path_constraints(automaton, cycle * 2))
        )
        if not isinstance(answer, Witness):
            return None
        if _may_be_disturbed(automaton, cycle, answer):
            return None
        bound = len(automaton.region(cycle[0].region).modes)
        rounds = bound // len(cycle) + 2
        lasting = query_engine.build_query(*path_constraints(automaton, cycle * rounds))
    except (KeyError, SpecError):
        return None
    return answer if lasting.holds_at(answer.valuation) else None


def _may_be_disturbed(automaton: Automaton, cycle: Cycle, witness: Witness) -> bool:
    """Return whether another region can change a variable that the guards read."""
    if any(name.startswith("mode.") for name in witness.valuation):
        return True
    others = (m for m in automaton.all_modes if m.region != cycle[0].region)
    written = {name for mode in others for part in mode.jump_assignments for name in part}
    return any(name.partition(".")[2] in written for name in witness.valuation)


def format_cycle(cycle: Cycle) -> str:
    """Return the sources of a cycle as text: `a` -> `b` -> `a`."""
    return " -> ".join(f"`{transition.source}`" for transition in (*cycle, cycle[0]))


def _range_hint(automaton: Automaton) -> str:
    """Return the hint to declare ranges of states without one; an empty text if there are none."""
    names = [f"`{name}`" for name, state in automaton.states.items() if state.range is None]
    return f", or give {', '.join(names)} a `range` if this is out of reach" if names else ""


def _boundary_transition(automaton: Automaton, cycle: Cycle) -> Transition:
    """Return the last transition whose guard holds on a boundary; else the last one."""
    bare = (t for t in reversed(cycle) if _has_boundary(t.when.tree, automaton.states))
    return next(bare, cycle[-1])


def _has_boundary(guard: SyntaxTree, states: Mapping[str, object]) -> bool:
    """Return whether a guard compares a state by `<=` or `>=`."""
    for part in walk(guard):
        if isinstance(part, Relation) and part.operator in ("<=", ">="):
            sides = (part.left, part.right)
            if any(isinstance(side, Name) and side.path in states for side in sides):
                return True
    return False
