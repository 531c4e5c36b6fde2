"""Linear: the balances of a mode as rates, and their matrices at a point, as expressions."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import reduce

from language.expressions.balance_form import coefficient_of
from language.expressions.differentiate import (
    SMOOTH_FUNCTIONS,
    PointValue,
    derivative_error,
    differentiate,
    select_branch,
)
from language.expressions.simplify import (
    add,
    divide,
    is_zero,
    make_number,
    multiply,
    negate,
    substitute_names,
    subtract,
)
from language.expressions.syntax_tree import (
    Arithmetic,
    FunctionCall,
    Name,
    Negation,
    Power,
    SyntaxTree,
    names,
    walk,
)
from language.lowering.expressions import lower_expression
from language.lowering.parameter_bindings import constant_bindings
from language.model.automaton import Automaton, Balance, Mode, ModelRun
from language.model.evaluation_order import equation_order
from language.numerics.evaluate import Scalar, evaluate
from language.text.diagnostic import Problems, SpecError

MAX_INLINED_NODES = 20_000
"""Names, numbers and operations of an equation with all others put in; those shipped have 100."""

SymbolicMatrix = dict[str, dict[str, SyntaxTree]]
"""A matrix by the names of its rows and columns, zeros left out."""


@dataclass(frozen=True)
class LinearisationPoint:
    """Where a flow is made linear: some names with their values, as expressions.

    `values` are those of the constants of `automaton`, whose parameters the values may read.
    """

    automaton: Automaton
    constant_values: Mapping[str, Scalar]
    substitutions: Mapping[str, SyntaxTree]

    @property
    def evaluator(self) -> PointValue:
        """The value of an expression at the point. Raises SpecError where a name has none."""
        known = constant_bindings(self.automaton)

        def at(tree: SyntaxTree) -> Scalar:
            here = substitute_names(tree, self.substitutions)
            for read in names(here):
                if read.path not in known:
                    label = f"`{read.path}` decides which branch is taken"
                    raise derivative_error(read.span, label, _point_hint(read.path))
            return evaluate(lower_expression(here, known), self.constant_values)

        return at


def inline_equations(mode: Mode, substitutions: Mapping[str, SyntaxTree]) -> dict[str, SyntaxTree]:
    """Return the equations of a mode in states, inputs and parameters; some names are given.

    Raises SpecError where they would be too large: each read of an equation copies it.
    """
    if exceeds_inlining_limit(mode):
        problems = Problems()
        label = f"the equations of mode `{mode.name}` are too large to be put into each other"
        hint = f"they would have more than {MAX_INLINED_NODES} parts; write the matrices, or fewer steps"
        problems.error("expression", mode.span, label, hint)
        raise SpecError(problems.reported)
    known = dict(substitutions)
    own = [name for name in equation_order(mode) if name in mode.equations]
    for name in own:  # those of a region beside are not known: its mode chooses them
        known[name] = substitute_names(mode.equations[name].tree, known)
    return known


def exceeds_inlining_limit(mode: Mode) -> bool:
    """Tell whether the equations of a mode, put into each other, have more parts than are handled.

    An equation that is read twice by the next, and so on 50 times, would have 2^50 parts.
    """
    sizes: dict[str, int] = {}
    for name in equation_order(mode):
        if name in mode.equations:
            formula = mode.equations[name]
            read = sum(sizes.get(path, 0) for path in formula.reads)
            sizes[name] = len(walk(formula.tree)) + read
    return max(sizes.values(), default=0) > MAX_INLINED_NODES


def symbolic_rates(mode: Mode, substitutions: Mapping[str, SyntaxTree]) -> dict[str, SyntaxTree]:
    """Return der(x) of every state of a mode, with what is known put in."""
    found = {}
    for name, balance in mode.flow.items():
        factor = coefficient_of(balance.left, name)
        if isinstance(factor, SpecError):
            raise factor
        right = substitute_names(balance.right, substitutions)
        found[name] = (
            right if factor is None else divide(right, substitute_names(factor, substitutions))
        )
    return found


def symbolic_jacobian(
    trees: Mapping[str, SyntaxTree], columns: Iterable[str], point: LinearisationPoint
) -> SymbolicMatrix:
    """Return the derivatives of the trees (rows) by the columns at the point. Raises SpecError."""
    found: SymbolicMatrix = {}
    columns = tuple(columns)
    for row, tree in trees.items():
        entries = {}
        for column in columns:
            entry = substitute_names(
                differentiate(tree, column, point.evaluator), point.substitutions
            )
            if not is_zero(entry):
                entries[column] = entry
        if entries:
            found[row] = entries
    return found


def affine_offset(
    tree: SyntaxTree, columns: Collection[str], point: LinearisationPoint
) -> SyntaxTree:
    """Return what the tangent of a tree has besides slope * column: its value where these are 0.

    Sums are taken apart, so that only the terms that are not linear read the point.
    """

    def inside(part: SyntaxTree) -> SyntaxTree:
        return affine_offset(part, columns, point)

    if not _reads_any(tree, columns):
        return tree
    match tree:
        case Name(_, span):
            return make_number(0, span)
        case Negation(operand, _):
            return negate(inside(operand))
        case Arithmetic("+", left, right, _):
            return add(inside(left), inside(right))
        case Arithmetic("-", left, right, _):
            return subtract(inside(left), inside(right))
        case Arithmetic("*", left, right, _) if not _reads_any(left, columns):
            return multiply(left, inside(right))
        case Arithmetic("*", left, right, _) if not _reads_any(right, columns):
            return multiply(inside(left), right)
        case Arithmetic("/", left, right, _) if not _reads_any(right, columns):
            return divide(inside(left), right)
        case Arithmetic() | Power():
            return _nonlinear_offset(tree, columns, point)
        case FunctionCall(function, _, _) if function in SMOOTH_FUNCTIONS:
            return _nonlinear_offset(tree, columns, point)
        case _:
            return inside(select_branch(tree, point.evaluator))


def _reads_any(tree: SyntaxTree, columns: Collection[str]) -> bool:
    return any(read.path in columns for read in names(tree))


def _nonlinear_offset(
    tree: SyntaxTree, columns: Collection[str], point: LinearisationPoint
) -> SyntaxTree:
    """The value at the point less slope * column there."""
    result = substitute_names(tree, point.substitutions)
    for column in dict.fromkeys(read.path for read in names(tree) if read.path in columns):
        if column not in point.substitutions:
            raise derivative_error(
                tree.span, f"`{column}` does not enter linearly here", _point_hint(column)
            )
        slope = substitute_names(differentiate(tree, column, point.evaluator), point.substitutions)
        result = subtract(result, multiply(slope, point.substitutions[column]))
    return result


def _point_hint(name: str) -> str:
    return f"give its point: `at: {{{name}: ...}}`"


def affine_form(slopes: Mapping[str, SyntaxTree], offset: SyntaxTree) -> SyntaxTree:
    """Return the sum of slope * column, plus the rest."""
    parts = [multiply(slope, Name(column, offset.span)) for column, slope in slopes.items()]
    return reduce(add, [*parts, offset])


def linearise_model(
    model: Automaton, run: ModelRun, point: LinearisationPoint, problems: Problems
) -> Automaton:
    """Return the model with affine flows: what is linear stays, what is curved has its tangent.

    Equations and guards stay as they are. `point` gives values and parameters, not yet places.
    """
    places = {name: formula.tree for name, formula in (run.linearise or {}).items()}
    there = dataclasses.replace(point, substitutions=places)
    modes = {}
    for name, mode in model.modes.items():
        modes[name] = mode
        with problems.collect_errors():
            modes[name] = _linearise_mode(mode, run, there)
    return dataclasses.replace(model, modes=modes)


def _linearise_mode(mode: Mode, run: ModelRun, point: LinearisationPoint) -> Mode:
    flow = symbolic_rates(mode, inline_equations(mode, {}))
    slopes = symbolic_jacobian(flow, tuple(flow), point)
    problems = Problems()
    balances = {}
    for state, tree in flow.items():
        for column, slope in slopes.get(state, {}).items():
            for read in names(slope):
                if read.path not in point.automaton.parameters:
                    label = f"the tangent of `{state}` by `{column}` depends on `{read.path}`"
                    help = f"give its point in `linearise`: `at: {{{read.path}: ...}}`"
                    problems.error("method", run.span, label, help)
        if problems.has_errors:
            continue
        span = tree.span
        left = FunctionCall("der", (Name(state, span),), span)
        right = affine_form(slopes.get(state, {}), affine_offset(tree, tuple(flow), point))
        balances[state] = Balance(state, left, right, mode.flow[state].key)
    if problems.has_errors:
        raise SpecError(problems.reported)
    return dataclasses.replace(mode, flow=balances)
