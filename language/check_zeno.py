"""Check of chatter: modes that can change infinitely often in a finite time (rule 12).

A point is looked for at which each flow of a way round makes the next guard true at once, and the
resets change nothing: a Zeno equilibrium (Lamperski and Ames, IEEE TAC 58 (2013), section III). A
bouncing ball has one where it rests, a thermostat with one limit at that limit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from language.along import Along, NoRate
from language.check_cycle import Way, instant_ways
from language.inquiry import Inquiry, Witness
from language.model import Automaton, Transition
from language.moment import Moment, Story
from language.operation import (
    Binary,
    Call,
    Compare,
    Expr,
    Ref,
    Unary,
    Value,
    multiply,
    real,
    subtract,
)
from language.problem import Problems, SpecError
from language.question import Question
from language.syntax import Application, walk

TIMED = ("after", "every", "rising", "falling", "changed", "delay")
"""Functions by which a guard needs time, or an earlier instant."""
NEAR = 1.0e-9
"""Relative; a witness lies on a boundary up to rounding, which z3 finds exactly."""
ASIDE = 1.0e-3
"""Relative; how far beside the point resets are tried: the step of a secant."""
OPPOSITE = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}


def check_zeno(automaton: Automaton, inquiry: Inquiry, problems: Problems) -> None:
    """Warn of ways to a mode and back that can be taken infinitely often in a finite time."""
    for way in _ways(automaton):
        try:
            witness = _equilibrium(automaton, way, inquiry)
        except (KeyError, SpecError, NoRate):
            continue
        if witness:
            path = " -> ".join(f"`{each.source}`" for each in (*way, way[0]))
            label = f"here the modes can change infinitely often in a finite time: {path}"
            hint = f"at {witness.text} each flow leads back at once; "
            hint += "leave a distance between the limits (a hysteresis), or let one of them wait"
            problems.warning("zeno", way[0].when.span, label, hint)


def _ways(automaton: Automaton) -> Iterator[Way]:
    """Yield the transitions that lead back to their source, and pairs there and back."""
    if automaton.is_sampled or automaton.regions:
        return
    quick = [way for way in instant_ways(automaton) if not _is_timed(way)]
    for place, first in enumerate(quick):
        if first.source == first.target:
            yield (first,)
            continue
        for second in quick[place + 1 :]:
            if (first.source, first.target) == (second.target, second.source):
                yield first, second


def _is_timed(way: Transition) -> bool:
    parts = (part for part in walk(way.when.tree) if isinstance(part, Application))
    return any(part.function in TIMED for part in parts)


def _equilibrium(automaton: Automaton, way: Way, inquiry: Inquiry) -> Witness | None:
    """Return a point that the flows and resets of a way round lead to for ever, if there is one."""
    story = Story()
    start = moment = Moment(automaton, automaton.source(way[0]), story)
    exact: list[Expr] = []
    near: list[Expr] = []
    assigned: dict[str, Expr] = {}
    for transition in way:
        guard = moment.expression(transition.when.tree)
        becoming = _Becoming(moment)
        exact.append(becoming.of(guard, True))
        near.append(_loosened(exact[-1]))
        after = moment.after(transition)
        for state in automaton.states:
            if after.known[state] != start.known[state]:
                known = start.known[state]
                assigned.update({known.name: after.known[state]} if isinstance(known, Ref) else {})
                same = Compare("==", after.known[state], start.known[state])
                exact.append(same)
                near.append(_loosened(same))
        moment = after
    found = inquiry.confirmed(inquiry.question(story, exact), inquiry.question(story, near))
    return found if found and _is_drawn_in(assigned, inquiry.question(story, near), found) else None


def _is_drawn_in(assigned: Mapping[str, Expr], question: Question, witness: Witness) -> bool:
    """Tell whether resets bring a state nearer to the point: a bounce without loss does not."""
    for name, value in assigned.items():
        place = float(witness.point.get(name, 0.0))
        moved = place + ASIDE * (1.0 + abs(place))
        beside = question.value_at({**witness.point, name: moved}, value)
        here = question.value_at(witness.point, value)
        if abs(beside - here) >= (1.0 - NEAR) * abs(moved - place):
            return False
    return True


class _Becoming:
    """What makes a condition true now, or at once along the flow of a moment's mode."""

    def __init__(self, moment: Moment) -> None:
        self.moment = moment
        self.along = Along(moment)

    def of(self, condition: Expr, is_true: bool) -> Expr:
        match condition:
            case Unary("not", operand):
                return self.of(operand, not is_true)
            case Binary("and" | "or" as operator, left, right):
                sides = self.of(left, is_true), self.of(right, is_true)
                return Binary("and" if (operator == "and") == is_true else "or", *sides)
            case Compare(operator, left, right) if operator not in ("==", "!="):
                relation = operator if is_true else OPPOSITE[operator]
                return self._relation(relation, left, right)
            case Ref(name):
                found = next((v for target, v in self.moment.story.steps if target == name), None)
                if found is not None:
                    return self.of(found, is_true)
        return condition if is_true else Unary("not", condition)

    def _relation(self, operator: str, left: Expr, right: Expr) -> Expr:
        """Sides are apart; or they are equal and move apart, or begin to."""
        larger, smaller = (left, right) if operator in (">", ">=") else (right, left)
        now = Compare(">", larger, smaller)
        first = self.along.of(subtract(larger, smaller))
        zero = real(0.0)
        if isinstance(first, Value):
            return now
        moving: Expr = Compare(">", first, zero)
        second = self.along.of(first)
        if not isinstance(second, Value):
            begun = Binary("and", Compare("==", first, zero), Compare(">", second, zero))
            moving = Binary("or", moving, begun)
        return Binary("or", now, Binary("and", Compare("==", larger, smaller), moving))


def _loosened(condition: Expr) -> Expr:
    """Return a condition in which real sides that have to be equal are so up to rounding."""
    match condition:
        case Binary("and" | "or" as operator, left, right):
            return Binary(operator, _loosened(left), _loosened(right))
        case Compare("==", left, right) if not isinstance(left, Ref) or not left.whole:
            size = Binary("+", real(1.0), Call("abs", (right,)))
            apart = Call("abs", (subtract(left, right),))
            return Compare("<=", apart, multiply(real(NEAR), size))
    return condition
