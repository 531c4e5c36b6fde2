"""Guards: transitions of one mode that can be enabled together need priorities (rule 3)."""

from __future__ import annotations

from collections.abc import Iterator

from language.inquiry import Inquiry, Witness
from language.model import Automaton, Mode, Transition
from language.moment import Moment
from language.problem import Problems, SpecError
from language.question import Question
from language.syntax import Not, Relation, Tree, alike

DISJOINT = {"<": (">", ">="), "<=": (">",), ">": ("<", "<="), ">=": ("<",)}
"""Relations that exclude each other between the same two sides."""


MOST_OVERLAPS = 1000
"""Pairs told of in one mode; who has so many gives priorities to all."""


def report_overlaps(automaton: Automaton, inquiry: Inquiry, problems: Problems) -> None:
    """Report pairs of one priority that are not proven disjoint, with a witness if one is found."""
    for mode in automaton.all_modes:
        told = 0
        for earlier, later in _overlaps(mode):
            told += _report(automaton, mode, earlier, later, inquiry, problems)
            if told == MOST_OVERLAPS:
                break


def _overlaps(mode: Mode) -> Iterator[tuple[Transition, Transition]]:
    for position, later in enumerate(mode.transitions):
        for earlier in mode.transitions[:position]:
            same = (later.priority or 0) == (earlier.priority or 0)
            apart = earlier.events and later.events and not {*earlier.events} & {*later.events}
            if same and not apart and not excluded(earlier.when.tree, later.when.tree):
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
    automaton: Automaton,
    mode: Mode,
    earlier: Transition,
    later: Transition,
    inquiry: Inquiry,
    problems: Problems,
) -> bool:
    """Report a pair unless it is proven disjoint; tell whether it was reported."""
    question = _together(automaton, mode, earlier, later, inquiry)
    found = inquiry.freely(question) if question else "open"
    if found == "never":
        return False
    label = f"nothing proves that `{earlier.name}` and `{later.name}` exclude each other"
    if isinstance(found, Witness):
        at = f"at {found.text}" if found.text else "at one instant"
        label = f"`{earlier.name}` and `{later.name}` are both enabled {at}"
    hint = "give them different priorities: the smallest wins"
    problems.error("priority", later.when.span, label, hint)
    return True


def _together(
    automaton: Automaton, mode: Mode, earlier: Transition, later: Transition, inquiry: Inquiry
) -> Question | None:
    """Return the question whether two guards can hold together; None where they have no form."""
    moment = Moment(automaton, mode)
    try:
        guards = [moment.guard(way) for way in (earlier, later)]
    except (KeyError, SpecError):
        return None
    return inquiry.question(moment.story, guards)
