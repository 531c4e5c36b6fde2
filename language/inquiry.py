"""Inquiry: the answers to questions about one automaton - a witness, never, or open.

First a few sample points are tried, which answers most questions in no time; then z3 is asked. Its
witnesses too are told only where our own arithmetic says the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, lru_cache

from language.action import place_of
from language.constants import derive_block, parameter_constants, values_of
from language.declaration import Input, Parameter, State
from language.evaluate import Scalar
from language.halfspace import narrowed
from language.model import Automaton
from language.moment import Story
from language.number import NumberType, rounded
from language.operation import Assign, Expr
from language.parameter import parameter_kinds
from language.problem import Problems
from language.program import value_type
from language.question import Extent, Point, Question, Step, shown
from language.sample import few_points, many_points, near
from language.solver import SMALL_EFFORT, Solver, Verdict

MOST_TRIED = 20_000
"""Points tried of all questions that z3 leaves open: a second or two."""
MOST_ASKED = 4000
"""Questions for z3 of one check; beyond they stay open."""


@dataclass(frozen=True)
class Witness:
    """Values at which all conditions of a question hold, as our own arithmetic says."""

    point: Point
    text: str

    @property
    def place(self) -> str:
        """How a help begins: `at x = 0.5; `, empty where no value that is told matters."""
        return f"at {self.text}; " if self.text else ""


class Inquiry:
    """Asks about one automaton; parameters have their present values unless they are free."""

    def __init__(self, automaton: Automaton) -> None:
        """Find what every variable can be."""
        self.automaton = automaton
        self.asked = self.tried = 0
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
        narrower = narrowed(question)
        if narrower is None:
            return "never"
        found = next(filter(question.holds_at, few_points(question, narrower)), None)
        if found is None:
            decided = self._decided(question)
            if isinstance(decided, str) and decided == "never":
                return decided
            found = self._searched(question) if isinstance(decided, str) else decided
        return _witness(question, found) if found else "open"

    def freely(self, question: Question) -> Witness | Verdict:
        """Return the answer for all values that tunables can have, the present ones first."""
        found = self.answer(question)
        wider = self.freed(question) if found == "never" else None
        return self.answer(wider) if wider else found

    def never(self, question: Question) -> bool:
        """Tell whether it is proven that conditions never hold together, tunables being any."""
        self.asked += 1
        if self.asked > MOST_ASKED or not _proven(Asked(question.key, question)):
            return False
        wider = self.freed(question)
        return wider is None or _proven(Asked(wider.key, wider))

    def confirmed(self, exact: Question, near: Question) -> Witness | None:
        """Return a witness that z3 finds for a question, and that holds for one near to it."""
        self.asked += 1
        if self.asked > MOST_ASKED or narrowed(exact) is None:
            return None
        found = solver().ask(exact, SMALL_EFFORT)
        return (
            _witness(near, found) if not isinstance(found, str) and near.holds_at(found) else None
        )

    def _decided(self, question: Question) -> Point | Verdict:
        """Return a witness that z3 finds and our own arithmetic confirms, or what z3 says."""
        self.asked += 1
        found = solver().ask(question) if self.asked <= MOST_ASKED else "open"
        if isinstance(found, str):
            return found
        return next((point for point in near(found, question) if question.holds_at(point)), "open")

    def _searched(self, question: Question) -> Point | None:
        """Return a witness among many points, as long as not too many were tried in all."""
        for point in many_points(question):
            self.tried += 1
            if self.tried > MOST_TRIED:
                return None
            if question.holds_at(point):
                return point
        return None


@dataclass(frozen=True)
class Asked:
    """A question by what it says: the same one, asked again, has its answer already."""

    key: object
    question: Question = field(compare=False)


@lru_cache(maxsize=2048)
def _proven(asked: Asked) -> bool:
    """Tell whether conditions are proven never to hold together."""
    question = asked.question
    narrower = narrowed(question)
    if narrower is None:
        return True
    if any(question.holds_at(point) for point in few_points(question, narrower)):
        return False
    return solver().ask(question, SMALL_EFFORT) == "never"


@cache
def solver() -> Solver:
    """Return the one solver: what it has made of names and numbers is of use again."""
    return Solver()


def _witness(question: Question, point: Point) -> Witness:
    shorter = question.shortened(point)
    told = {name: value for name, value in shorter.items() if not name.startswith("memory.")}
    return Witness(shorter, shown(told, question.extents))


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
