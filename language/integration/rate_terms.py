"""Summands of the rates of a mode, through its equations, as they stand in the source."""

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
    """A summand of a state's rate: as written, and in terms of states, inputs and parameters."""

    source_tree: SyntaxTree
    expanded_tree: SyntaxTree


def source_text(tree: SyntaxTree) -> str:
    """Return the text of an expression in its line of the file.

    It is extended to the right for missing `)`, then to the left for missing `(`, until the
    parentheses balance or the line ends.
    """
    span = tree.span
    line = span.source.lines[span.line - 1]
    start, end = span.column - 1, span.column - 1 + span.width
    while end < len(line) and line[start:end].count("(") > line[start:end].count(")"):
        end += 1
    while start > 0 and line[start:end].count("(") < line[start:end].count(")"):
        start -= 1
    return line[start:end]


def rate_terms_of(mode: Mode, state: str) -> list[RateTerm]:
    """Return the summands of a state's balance, each also with all equations inlined.

    They are those of the right side, from left to right, without their signs; an equation that is a
    summand is split too. Raises SpecError if an inlined equation is too large, and KeyError if the
    mode has no balance of the state.
    """
    known = inline_equations(mode, {})
    return [RateTerm(tree, substitute_names(tree, known)) for tree in _summands(mode, state)]


def _summands(mode: Mode, state: str) -> Iterator[SyntaxTree]:
    """Yield the summands of the right side of a balance; an equation that is a term is split.

    Signs are dropped.
    """
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
    """Return the source texts of the terms that are not affine in the states, without repetitions.

    A term is affine if it reads only parameters, inputs and states, and its derivative by each
    state exists and reads parameters only; `point` selects branches of derivatives. A state whose
    balance is in a parallel region gives the text `der(<state>)`. Raises SpecError if an inlined
    equation is too large.
    """
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
    """Return the source text of the term of `row`'s rate with the largest slope in `column`.

    Both are states; the slope counts by its magnitude, and of equal ones the first term is taken.
    `parts` are the affine forms of the names that the rates read. The text is empty if the mode has
    no balance of the state, if its equations are too large, or if no term has a constant slope
    other than 0.
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
    """Return whether the derivatives of a term by all states depend on parameters only."""
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
