"""Terms: the summands of a mode's rates, through its equations, as the user wrote them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from language.derivative import derivative
from language.linear import Point, inlined, is_too_large
from language.model import Automaton, Mode
from language.problem import SpecError
from language.simplify import replaced
from language.syntax import Arithmetic, Name, Negative, Tree, names


@dataclass(frozen=True)
class Term:
    """A summand of a state's rate: as written, and in states, inputs and parameters."""

    written: Tree
    full: Tree

    @property
    def text(self) -> str:
        """The text of the summand in its file, with the brackets that its ends lack."""
        span = self.written.span
        line = span.source.lines[span.line - 1]
        start, end = span.column - 1, span.column - 1 + span.width
        while end < len(line) and line[start:end].count("(") > line[start:end].count(")"):
            end += 1
        while start > 0 and line[start:end].count("(") < line[start:end].count(")"):
            start -= 1
        return line[start:end]


def terms_of(mode: Mode, state: str) -> list[Term]:
    """Return the summands of a state's balance; an equation is taken apart where it is read."""
    known = inlined(mode, {})

    def parts(tree: Tree) -> Iterator[Tree]:
        match tree:
            case Negative(operand, _):
                yield from parts(operand)
            case Arithmetic("+" | "-", left, right, _):
                yield from parts(left)
                yield from parts(right)
            case Name(path, _) if path in mode.equations:
                yield from parts(mode.equations[path].tree)
            case _:
                yield tree

    return [Term(tree, replaced(tree, known)) for tree in parts(mode.flow[state].right)]


def other_terms(automaton: Automaton, mode: Mode, point: Point) -> list[str]:
    """Return the terms that are not linear in the states with constant coefficients, as texts."""
    found: dict[str, None] = {}
    for state in automaton.states:
        if state not in mode.flow:
            found[f"der({state})"] = None  # chosen by a region beside
            continue
        for term in terms_of(mode, state):
            if not _is_affine(term, automaton, point):
                found[term.text] = None
    return list(found)


def strongest(mode: Mode, row: str, column: str, point: Point) -> Term | None:
    """Return the term of a state's rate that changes most with another state."""
    best: Term | None = None
    largest = 0.0
    if is_too_large(mode):
        return None
    for term in terms_of(mode, row) if row in mode.flow else ():
        with suppress(SpecError):
            size = abs(float(point.value(derivative(term.full, column, point.value))))
            if size > largest:
                best, largest = term, size
    return best


def _is_affine(term: Term, automaton: Automaton, point: Point) -> bool:
    parameters = point.automaton.parameters
    known = {*parameters, *automaton.inputs, *automaton.states}
    if any(read.path not in known for read in names(term.full)):
        return False
    for column in automaton.states:
        try:
            slope = derivative(term.full, column, point.value)
        except SpecError:
            return False
        if any(read.path not in parameters for read in names(slope)):
            return False
    return True
