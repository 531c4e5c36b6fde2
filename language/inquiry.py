"""Inquiry: the answers to questions about one automaton - a witness, never, or open.

First a few sample points are tried, which answers most questions in no time; then z3 is asked. Its
witnesses too are told only where our own arithmetic says the same.
"""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

from language.action import place_of
from language.constants import derive_block, parameter_constants, values_of
from language.declaration import Input, Parameter, State
from language.evaluate import Scalar, evaluate
from language.halfspace import disproved
from language.model import Automaton
from language.moment import Story
from language.number import NumberType, rounded
from language.operation import Assign, Compare, Expr, Ref
from language.parameter import parameter_kinds
from language.problem import Problems
from language.program import value_type
from language.question import Extent, Point, Question, Step, shown
from language.solver import Solver, Verdict
from language.traversal import parts

SAMPLES = 8
"""Points that are tried before z3 is asked: most guards hold at one of them."""
MOST_SAMPLES = 64
"""Points that are tried where z3 knows nothing."""
DEFAULT_RANGE = (-10.0, 10.0)
"""Sampled where a state or input gives no range, in SI."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
MOST_ASKED = 4000
"""Questions for z3 of one check; beyond they stay open."""


@dataclass(frozen=True)
class Witness:
    """Values at which all conditions of a question hold, as our own arithmetic says."""

    point: Point
    text: str


class Inquiry:
    """Asks about one automaton; parameters have their present values unless they are free."""

    def __init__(self, automaton: Automaton, solver: Solver | None = None) -> None:
        """Find what every variable can be; a solver may be shared."""
        self.automaton = automaton
        self.solver = solver or Solver()
        self.asked = 0
        self.values = values_of(parameter_constants(automaton, Problems()))
        self.extents = dict(_extents(automaton))
        self.tunables = {
            f"calibration.{name}": _bounded(automaton.parameters[name], automaton.numbers)
            for name, kind in parameter_kinds(automaton).items()
            if kind == "tunable" and not automaton.parameters[name].table
        }
        self.derived: list[Step] = [
            (op.target, op.value) for op in derive_block(automaton) if isinstance(op, Assign)
        ]

    def question(self, story: Story, conditions: Iterable[Expr]) -> Question:
        """Return the question whether some conditions can hold together in a story."""
        extents = {**self.extents, **story.extents}
        together = (*conditions, *story.facts)
        return Question(together, tuple(story.steps), extents, self.values)

    def freed(self, question: Question) -> Question | None:
        """Return the question with all values that tunables can have, None if it reads none."""
        wider = replace(
            question,
            steps=(*self.derived, *question.steps),
            extents={**question.extents, **self.tunables},
        )
        return wider if any(name in wider.read for name in self.tunables) else None

    def answer(self, question: Question) -> Witness | Verdict:
        """Return a witness, "never", or "open"."""
        if disproved(question):
            return "never"
        found = self._sampled(question, range(1, SAMPLES))
        if found is None:
            decided = self._decided(question)
            if decided != "open":
                return decided
            found = self._sampled(question, range(SAMPLES, MOST_SAMPLES))
        return found or "open"

    def _decided(self, question: Question) -> Witness | Verdict:
        """Return what z3 answers."""
        self.asked += 1
        if self.asked > MOST_ASKED:
            return "open"
        found = self.solver.ask(question)
        if isinstance(found, str):
            return found
        for point in _near(found, question):
            if question.holds_at(point):
                return self._witness(question, point)
        return "open"

    def freely(self, question: Question) -> Witness | Verdict:
        """Return the answer for all values that tunables can have, the present ones first."""
        found = self.answer(question)
        wider = self.freed(question) if found == "never" else None
        return self.answer(wider) if wider else found

    def _witness(self, question: Question, point: Point) -> Witness:
        shorter = question.shortened(point)
        told = {name: value for name, value in shorter.items() if not name.startswith("memory.")}
        return Witness(shorter, shown(told, question.extents))

    def _sampled(self, question: Question, indices: range) -> Witness | None:
        """Try sample points, each also moved onto the boundaries that conditions name."""
        variables = question.variables
        relations = [part for condition in question.conditions for part in _relations(condition)]
        for index in indices:
            point: Point = {
                name: _sample(question.extents[name], index, position)
                for position, name in enumerate(variables)
            }
            moved = (p for relation in relations for p in _on_boundary(relation, point, question))
            for tried in (point, *moved):
                if question.holds_at(tried):
                    return self._witness(question, tried)
        return None


def _relations(condition: Expr) -> Iterator[Compare]:
    return (part for part in parts(condition) if isinstance(part, Compare))


def _on_boundary(relation: Compare, point: Point, question: Question) -> Iterator[Point]:
    for side, other in ((relation.left, relation.right), (relation.right, relation.left)):
        if isinstance(side, Ref) and side.name in point and not side.whole:
            try:
                value = evaluate(other, ChainMap(point, dict(question.values)))
            except (KeyError, OverflowError):
                continue
            yield {**point, side.name: value}


def _near(point: Point, question: Question) -> Iterator[Point]:
    """Yield a point of z3 and, since it is rounded, neighbours of it along each variable."""
    default = {
        name: extent.default
        for name in point
        if (extent := question.extents[name]).default is not None
    }
    yield {**point, **default}
    yield point
    for name, value in point.items():
        if isinstance(value, float):
            for towards in (-math.inf, math.inf):
                yield {**point, name: math.nextafter(value, towards)}
    for index in range(1, SAMPLES):
        for position, name in enumerate(point):
            yield {**point, name: _sample(question.extents[name], index, position)}


def _sample(extent: Extent, index: int, position: int) -> Scalar:
    if extent.default is not None:
        return extent.default
    if extent.type == "truth":
        return bool(index >> position % 6 & 1)
    if extent.numbers:
        return extent.numbers[index % len(extent.numbers)]
    low = DEFAULT_RANGE[0] if extent.low is None else float(extent.low)
    high = DEFAULT_RANGE[1] if extent.high is None else float(extent.high)
    low, high = min(low, high), max(low, high)
    fraction = _radical_inverse(index, PRIMES[position % len(PRIMES)])
    value = low + fraction * (high - low)
    return math.floor(value) if extent.type == "whole" else value


def _extents(automaton: Automaton) -> Iterator[tuple[str, Extent]]:
    for name, thing in automaton.inputs.items():
        extent = _bounded(thing, automaton.numbers)
        if thing.default is not None:
            default: Scalar = rounded(thing.default, automaton.numbers)
            extent = replace(extent, default=_typed(default, extent))
        yield f"input.{name}", extent
    for name, variable in automaton.carried.items():
        yield place_of(automaton, name), _bounded(variable, automaton.numbers)


def _typed(value: Scalar, extent: Extent) -> Scalar:
    if extent.type == "truth":
        return bool(value)
    return int(value) if extent.type == "whole" else value


def _bounded(thing: Input | State | Parameter, numbers: NumberType) -> Extent:
    """Return what a declared thing can be, with its bounds as a program has them."""
    if thing.type == "enum":
        places = tuple(range(len(thing.values)))
        return Extent("whole", numbers=places, names=thing.values)
    bounds = [Fraction(rounded(bound, numbers)) for bound in thing.range or ()]
    low, high = bounds or (None, None)
    return Extent(value_type(thing.type), low, high)


def _radical_inverse(index: int, base: int) -> float:
    """Return the van der Corput number of an index in a base, in [0, 1)."""
    result, scale = 0.0, 1.0 / base
    while index > 0:
        index, digit = divmod(index, base)
        result += digit * scale
        scale /= base
    return result
