"""Terms: the summands of a mode's rates, through its equations, as the user wrote them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.expressions.differentiate import differentiate
from language.expressions.simplify import substitute_names
from language.expressions.syntax_tree import Arithmetic, Name, Negation, SyntaxTree, names
from language.integration.vector_field import VectorField, all_bindings_at_point
from language.lowering.expressions import lower_expression
from language.lowering.linearisation import (
    LinearisationPoint,
    exceeds_inlining_limit,
    inline_equations,
)
from language.model.automaton import Automaton, Mode
from language.numerics.affine_form import AffineForm, to_affine_form
from language.text.diagnostic import SpecError


@dataclass(frozen=True)
class RateTerm:
    """A summand of a state's rate: as written, and in states, inputs and parameters."""

    source_tree: SyntaxTree
    expanded_tree: SyntaxTree


def source_text(tree: SyntaxTree) -> str:
    """Return the text of an expression in its file, with the brackets that its ends lack."""
    span = tree.span
    line = span.source.lines[span.line - 1]
    start, end = span.column - 1, span.column - 1 + span.width
    while end < len(line) and line[start:end].count("(") > line[start:end].count(")"):
        end += 1
    while start > 0 and line[start:end].count("(") < line[start:end].count(")"):
        start -= 1
    return line[start:end]


def rate_terms_of(mode: Mode, state: str) -> list[RateTerm]:
    """Return the summands of a state's balance, with all equations put in. Raises SpecError."""
    known = inline_equations(mode, {})
    return [RateTerm(tree, substitute_names(tree, known)) for tree in _summands(mode, state)]


def _summands(mode: Mode, state: str) -> Iterator[SyntaxTree]:
    """Yield the summands of a state's balance; an equation is taken apart where it is read."""
    stack = [mode.flow[state].right]
    while stack:
        match stack.pop():
            case Negation(operand, _):
                stack.append(operand)
            case Arithmetic("+" | "-", left, right, _):
                stack += [right, left]
            case Name(path, _) if path in mode.equations:
                stack.append(mode.equations[path].tree)
            case tree:
                yield tree


def non_affine_terms(automaton: Automaton, mode: Mode, point: LinearisationPoint) -> list[str]:
    """Return the terms that are not linear in the states with constant coefficients, as texts."""
    found: dict[str, None] = {}
    for state in automaton.states:
        if state not in mode.flow:
            found[f"der({state})"] = None  # chosen by a region beside
            continue
        for term in rate_terms_of(mode, state):
            if not _is_affine(term, automaton, point):
                found[source_text(term.source_tree)] = None
    return list(found)


def steepest_term(
    field: VectorField, mode: Mode, row: str, column: str, parts: Mapping[str, AffineForm]
) -> str:
    """Return the term of a state's rate that is steepest in another state, as it is written.

    `parts` is what the names of the block of rates are in the states; an empty text where no term
    is linear with a constant coefficient, or where there are too many.
    """
    if row not in mode.flow or exceeds_inlining_limit(mode):
        return ""
    known = all_bindings_at_point(field)
    best: SyntaxTree | None = None
    largest = 0.0
    for tree in _summands(mode, row):
        size = abs(
            to_affine_form(lower_expression(tree, known), parts).coefficients.get(column, 0.0)
        )
        if size > largest:
            best, largest = tree, size
    return source_text(best) if best else ""


def _is_affine(term: RateTerm, automaton: Automaton, point: LinearisationPoint) -> bool:
    parameters = point.automaton.parameters
    known = {*parameters, *automaton.inputs, *automaton.states}
    if any(read.path not in known for read in names(term.expanded_tree)):
        return False
    for column in automaton.states:
        try:
            slope = differentiate(term.expanded_tree, column, point.evaluator)
        except SpecError:
            return False
        if any(read.path not in parameters for read in names(slope)):
            return False
    return True
