"""Guards: transitions of one mode that can be enabled together need priorities (rule 3)."""

from __future__ import annotations

from language.model import Automaton, Mode, Transition
from language.problem import Problems
from language.syntax import Not, Relation, Tree, form
from language.witness import WitnessSearch

DISJOINT = {"<": (">", ">="), "<=": (">",), ">": ("<", "<="), ">=": ("<",)}
"""Relations that exclude each other between the same two sides."""


def report_overlaps(automaton: Automaton, mode: Mode, problems: Problems) -> None:
    """Report pairs of one priority that are not proven disjoint, with a witness if one is found."""
    for position, later in enumerate(mode.transitions):
        for earlier in mode.transitions[:position]:
            same = (later.priority or 0) == (earlier.priority or 0)
            if same and not excluded(earlier.when.tree, later.when.tree):
                _report(automaton, earlier, later, problems)


def excluded(left: Tree, right: Tree) -> bool:
    """Tell whether two guards exclude each other by their form: `a < b` and `a >= b`, `not g`."""
    if isinstance(right, Not) and form(right.operand) == form(left):
        return True
    if isinstance(left, Not) and form(left.operand) == form(right):
        return True
    if isinstance(left, Relation) and isinstance(right, Relation):
        same = form((left.left, left.right)) == form((right.left, right.right))
        return same and right.operator in DISJOINT.get(left.operator, ())
    return False


def _report(
    automaton: Automaton, earlier: Transition, later: Transition, problems: Problems
) -> None:
    search = WitnessSearch(automaton)
    point = search.both(earlier, later)
    hint = "give them different priorities: the smallest wins"
    if point is not None:
        values = search.shown(point, [earlier.when.tree, later.when.tree])
        label = f"`{earlier.name}` and `{later.name}` are both enabled at {values}"
    else:
        label = f"nothing proves that `{earlier.name}` and `{later.name}` exclude each other"
    problems.error("priority", later.when.span, label, hint)
