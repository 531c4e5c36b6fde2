"""Determinism check: transitions of one mode with equal priority need disjoint guards (rule 3).

Guards are disjoint by form (`a < b` and `a >= b`), by linear bounds or by a proof of z3.
"""

from __future__ import annotations

from collections.abc import Iterator

from language.expressions.syntax_tree import Not, Relation, SyntaxTree
from language.model.automaton import Automaton, Mode, Transition
from language.smt.query import SolverQuery
from language.smt.query_engine import QueryEngine, Witness
from language.smt.symbolic_environment import GuardSnapshot
from language.text.diagnostic import Problems, SpecError

EXCLUSIVE_RELATIONS = {"<": (">", ">="), "<=": (">",), ">": ("<", "<="), ">=": ("<",)}
"""Relations that exclude the relation of the key between the same two sides."""

MAX_OVERLAPS = 1000
"""Largest number of pairs that are reported in one mode."""


def check_guard_overlap(
    automaton: Automaton, query_engine: QueryEngine, problems: Problems
) -> None:
    """Report pairs of transitions of one mode with equal priority whose guards may hold together.

    A missing priority is 0. Pairs with disjoint events, and guards that are exclusive by form or
    proven so for all values of tunable parameters, are left out. The problem shows a witness if one
    is found, and is placed at the later guard. At most MAX_OVERLAPS pairs of a mode are reported.
    """
    for mode in automaton.all_modes:
        reported = 0
        for earlier, later in _overlap_candidates(mode):
            reported += _report_overlap(automaton, mode, earlier, later, query_engine, problems)
            if reported == MAX_OVERLAPS:
                break


def _overlap_candidates(mode: Mode) -> Iterator[tuple[Transition, Transition]]:
    """Yield pairs of transitions of a mode that can be enabled together.

    They have equal priority, no disjoint events, and guards that are not exclusive by form. The
    earlier one in the file comes first.
    """
    for position, later in enumerate(mode.transitions):
        for earlier in mode.transitions[:position]:
            same_priority = (later.priority or 0) == (earlier.priority or 0)
            disjoint_events = (
                earlier.events and later.events and not {*earlier.events} & {*later.events}
            )
            if (
                same_priority
                and not disjoint_events
                and not are_syntactically_exclusive(earlier.when.tree, later.when.tree)
            ):
                yield earlier, later


def are_syntactically_exclusive(left: SyntaxTree, right: SyntaxTree) -> bool:
    """Return whether two guards exclude each other by their form.

    The forms are `not g` and `g`, and two opposed relations (EXCLUSIVE_RELATIONS) between the same
    sides in the same order, like `a < b` and `a >= b`. `b > a` and a relation inside an `and` are
    not recognised.
    """
    if isinstance(right, Not) and right.operand == left:
        return True
    if isinstance(left, Not) and left.operand == right:
        return True
    if isinstance(left, Relation) and isinstance(right, Relation):
        opposed = right.operator in EXCLUSIVE_RELATIONS.get(left.operator, ())
        return opposed and left.left == right.left and left.right == right.right
    return False


def _report_overlap(
    automaton: Automaton,
    mode: Mode,
    earlier: Transition,
    later: Transition,
    query_engine: QueryEngine,
    problems: Problems,
) -> bool:
    """Report a pair unless it is proven disjoint; return whether it was reported."""
    query = _overlap_query(automaton, mode, earlier, later, query_engine)
    answer = query_engine.answer_for_all_tunables(query) if query else "open"
    if answer == "never":
        return False
    label = f"nothing proves that `{earlier.name}` and `{later.name}` exclude each other"
    if isinstance(answer, Witness):
        at = f"at {answer.text}" if answer.text else "at one instant"
        label = f"`{earlier.name}` and `{later.name}` are both enabled {at}"
    hint = "give them different priorities: the smallest wins"
    problems.error("priority", later.when.span, label, hint)
    return True


def _overlap_query(
    automaton: Automaton,
    mode: Mode,
    earlier: Transition,
    later: Transition,
    query_engine: QueryEngine,
) -> SolverQuery | None:
    """Return the query whether two guards can hold together; None if a guard cannot be lowered."""
    snapshot = GuardSnapshot(automaton, mode)
    try:
        guards = [snapshot.lower_guard(each) for each in (earlier, later)]
    except (KeyError, SpecError):
        return None
    return query_engine.build_query(snapshot.path, guards)
