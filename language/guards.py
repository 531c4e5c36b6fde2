"""Guards: transitions of one mode that can be enabled together need priorities (rule 3)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from language.model import Automaton, Mode, Transition
from language.problem import Problems
from language.syntax import Not, Relation, Tree, alike
from language.witness import WitnessSearch

DISJOINT = {"<": (">", ">="), "<=": (">",), ">": ("<", "<="), ">=": ("<",)}
"""Relations that exclude each other between the same two sides."""


MOST_OVERLAPS = 1000
"""Pairs told of in one mode; who has so many gives priorities to all."""
MOST_SEARCHED = 100
"""Pairs for which a witness is searched; beyond, nothing proves that they exclude each other."""


def report_overlaps(automaton: Automaton, problems: Problems) -> None:
    """Report pairs of one priority that are not proven disjoint, with a witness if one is found."""
    pairs = [
        pair for mode in automaton.all_modes for pair in islice(_overlaps(mode), MOST_OVERLAPS)
    ]
    search = WitnessSearch(automaton, min(len(pairs), MOST_SEARCHED)) if pairs else None
    for number, (earlier, later) in enumerate(pairs):
        _report(search if number < MOST_SEARCHED else None, earlier, later, problems)


def _overlaps(mode: Mode) -> Iterator[tuple[Transition, Transition]]:
    for position, later in enumerate(mode.transitions):
        for earlier in mode.transitions[:position]:
            same = (later.priority or 0) == (earlier.priority or 0)
            if same and not excluded(earlier.when.tree, later.when.tree):
                yield earlier, later


def excluded(left: Tree, right: Tree) -> bool:
    """Tell whether two guards exclude each other by their form: `a < b` and `a >= b`, `not g`."""
    if isinstance(right, Not) and alike(right.operand, left):
        return True
    if isinstance(left, Not) and alike(left.operand, right):
        return True
    if isinstance(left, Relation) and isinstance(right, Relation):
        opposed = right.operator in DISJOINT.get(left.operator, ())
        return opposed and alike(left.left, right.left) and alike(left.right, right.right)
    return False


def _report(
    search: WitnessSearch | None, earlier: Transition, later: Transition, problems: Problems
) -> None:
    point = search.both(earlier, later) if search else None
    hint = "give them different priorities: the smallest wins"
    if search and point is not None:
        values = search.shown(point, [earlier.when.tree, later.when.tree])
        label = f"`{earlier.name}` and `{later.name}` are both enabled at {values}"
    else:
        label = f"nothing proves that `{earlier.name}` and `{later.name}` exclude each other"
    problems.error("priority", later.when.span, label, hint)
