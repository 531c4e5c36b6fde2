"""Decision: a guard as conditions and how they are joined; which of them were shown to matter.

MC/DC (Chilenski and Miller 1994, Applicability of modified condition/decision coverage): every
condition is shown to change the outcome alone. Unique cause: of two evaluations in which only it
differs, one is true. Masking: in both evaluations the outcome hangs on it, others may differ, too.
A condition that is written twice is one.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

from language.document import Scalar
from language.model import Transition
from language.model_text import tree_text
from language.operation import Binary, Expr, Unary
from language.parse import parse_expression
from language.problem import SpecError
from language.syntax import Logic, Not, Tree, Truth, alike

Joined = int | bool | tuple[str, "Joined"] | tuple[str, "Joined", "Joined"]
"""A condition by its place, `true` or `false`, or `not`, `and`, `or` of others."""
Shown = Literal["unique cause", "masking", "always true", "always false", "not shown"]
SHOWN: tuple[Shown, ...] = ("unique cause", "masking")
"""What counts as covered."""
MOST_CONDITIONS = 10
"""More have too many combinations to be kept, one for each."""


@dataclass(frozen=True)
class Decision:
    """The guard of a transition, by its key path; conditions in the order of the text.

    Events that it waits for come first; that a superstate has come to its end is one condition.
    """

    key: str
    conditions: tuple[str, ...]
    joined: Joined

    def outcome(self, combination: int) -> bool:
        """Return what the guard is; bit k of a combination is condition k."""
        return _value(self.joined, combination)

    def shown(self, seen: Collection[int]) -> tuple[Shown, ...]:
        """Return of each condition whether the combinations that were seen show that it matters."""
        return tuple(self._shown(1 << k, seen) for k in range(len(self.conditions)))

    def outcomes(self, seen: Collection[int]) -> frozenset[bool]:
        """Return what the guard has been."""
        return frozenset(self.outcome(combination) for combination in seen)

    def _shown(self, bit: int, seen: Collection[int]) -> Shown:
        ons = [one for one in seen if one & bit]
        offs = {one for one in seen if not one & bit}
        if any(one ^ bit in offs and self._matters(one, bit) for one in ons):
            return "unique cause"
        mattering = [one for one in ons if self._matters(one, bit)]
        others = [one for one in offs if self._matters(one, bit)]
        if any(self.outcome(a) != self.outcome(b) for a, b in itertools.product(mattering, others)):
            return "masking"
        if not offs or not ons:
            return "always true" if ons else "always false"
        return "not shown"

    def _matters(self, combination: int, bit: int) -> bool:
        return self.outcome(combination) != self.outcome(combination ^ bit)


def decision_of(transition: Transition) -> Decision:
    """Return what a transition asks for as a decision: its events, and its guard."""
    if transition.completes:
        return Decision(transition.key, ("completion",), 0)
    found: list[Tree] = []

    def joined(tree: Tree) -> Joined:
        match tree:
            case Logic(operator, left, right, _):
                return (operator, joined(left), joined(right))
            case Not(operand, _):
                return ("not", joined(operand))
            case Truth(value, _):
                return value
        place = next((k for k, known in enumerate(found) if alike(known, tree)), len(found))
        if place == len(found):
            found.append(tree)
        return place + len(transition.events)

    made: Joined = any_of(len(transition.events))
    guard = transition.when.tree
    if not (transition.events and isinstance(guard, Truth) and guard.value):
        own = joined(guard)
        made = ("and", made, own) if transition.events else own
    events = (f"event {name}" for name in transition.events)
    return Decision(transition.key, (*events, *map(_text, found)), made)


def any_of(count: int) -> Joined:
    """Return whether one of the first conditions holds."""
    made: Joined = 0
    for place in range(1, count):
        made = ("or", made, place)
    return made


def lowered_conditions(joined: Joined, expr: Expr) -> dict[int, Expr] | None:
    """Return what each condition is in a lowered guard; None where that is joined otherwise.

    A condition may be lowered to anything: `rising(x)` to whether x is true, and was not.
    """
    match joined, expr:
        case bool(), _:
            return {}
        case int(place), _:
            return {place: expr}
        case (("not", inner), Unary("not", operand)):
            return lowered_conditions(inner, operand)
        case ((operator, left, right), Binary(found, first, second)) if operator == found:
            parts = lowered_conditions(left, first), lowered_conditions(right, second)
            if parts[0] is not None and parts[1] is not None:
                return {**parts[1], **parts[0]}
    return None


def _value(joined: Joined, combination: int) -> bool:
    match joined:
        case bool():
            return joined
        case int():
            return bool(combination >> joined & 1)
        case ("not", operand):
            return not _value(operand, combination)
        case ("and", left, right):
            return _value(left, combination) and _value(right, combination)
        case (_, left, right):
            return _value(left, combination) or _value(right, combination)
    raise TypeError(f"not a decision: {joined}")


def _text(tree: Tree) -> str:
    """Return a condition as its author wrote it, where that is one text of the file."""
    span = tree.span
    if not span.whole and 1 <= span.line <= len(span.source.lines):
        line = span.source.lines[span.line - 1]
        text = line[span.column - 1 : span.column - 1 + span.width]
        with suppress(SpecError):
            if alike(parse_expression(Scalar(text, span)), tree):
                return text
    return tree_text(tree).removeprefix("(").removesuffix(")")
