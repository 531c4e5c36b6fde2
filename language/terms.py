"""Terms: the summands of a mode's rates, through its equations, as the user wrote them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.affine import Affine, affine
from language.derivative import derivative
from language.field import Field, all_known_at
from language.linear import Point, inlined, is_too_large
from language.lower import expression
from language.model import Automaton, Mode
from language.problem import SpecError
from language.simplify import replaced
from language.syntax import Arithmetic, Name, Negative, Tree, names


@dataclass(frozen=True)
class Term:
    """A summand of a state's rate: as written, and in states, inputs and parameters."""

    written: Tree
    full: Tree


def written(tree: Tree) -> str:
    """Return the text of an expression in its file, with the brackets that its ends lack."""
    span = tree.span
    line = span.source.lines[span.line - 1]
    start, end = span.column - 1, span.column - 1 + span.width
    while end < len(line) and line[start:end].count("(") > line[start:end].count(")"):
        end += 1
    while start > 0 and line[start:end].count("(") < line[start:end].count(")"):
        start -= 1
    return line[start:end]


def terms_of(mode: Mode, state: str) -> list[Term]:
    """Return the summands of a state's balance, with all equations put in. Raises SpecError."""
    known = inlined(mode, {})
    return [Term(tree, replaced(tree, known)) for tree in _summands(mode, state)]


def _summands(mode: Mode, state: str) -> Iterator[Tree]:
    """Yield the summands of a state's balance; an equation is taken apart where it is read."""
    stack = [mode.flow[state].right]
    while stack:
        match stack.pop():
            case Negative(operand, _):
                stack.append(operand)
            case Arithmetic("+" | "-", left, right, _):
                stack += [right, left]
            case Name(path, _) if path in mode.equations:
                stack.append(mode.equations[path].tree)
            case tree:
                yield tree


def other_terms(automaton: Automaton, mode: Mode, point: Point) -> list[str]:
    """Return the terms that are not linear in the states with constant coefficients, as texts."""
    found: dict[str, None] = {}
    for state in automaton.states:
        if state not in mode.flow:
            found[f"der({state})"] = None  # chosen by a region beside
            continue
        for term in terms_of(mode, state):
            if not _is_affine(term, automaton, point):
                found[written(term.written)] = None
    return list(found)


def strongest(field: Field, mode: Mode, row: str, column: str, parts: Mapping[str, Affine]) -> str:
    """Return the term of a state's rate that is steepest in another state, as it is written.

    `parts` is what the names of the block of rates are in the states; an empty text where no term
    is linear with a constant coefficient, or where there are too many.
    """
    if row not in mode.flow or is_too_large(mode):
        return ""
    known = all_known_at(field)
    best: Tree | None = None
    largest = 0.0
    for tree in _summands(mode, row):
        size = abs(affine(expression(tree, known), parts).slopes.get(column, 0.0))
        if size > largest:
            best, largest = tree, size
    return written(best) if best else ""


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
