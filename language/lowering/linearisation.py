"""Linearisation: rates, Jacobians and affine offsets of the flow of a mode, as expressions."""

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
from language.lowering.program_parameters import constant_bindings
from language.model.automaton import Automaton, Balance, Mode, ModelRun
from language.model.evaluation_order import equation_order
from language.numerics.evaluate import Scalar, evaluate
from language.text.diagnostic import Problems, SpecError

MAX_INLINED_NODES = 20_000
"""The largest number of names, numbers and operations of an equation with all others inlined.

The shipped examples have about 100.
"""

SymbolicMatrix = dict[str, dict[str, SyntaxTree]]
"""A matrix of expressions by the names of row and column; entries that are zero are left out."""


@dataclass(frozen=True)
class LinearisationPoint:
    """A point of linearisation: the expressions of some names at the point.

    `constant_values` are the values of the constants of `automaton`, whose parameters the
    expressions in `substitutions` may read.
    """

    automaton: Automaton
    constant_values: Mapping[str, Scalar]
    substitutions: Mapping[str, SyntaxTree]

    @property
    def evaluator(self) -> PointValue:
        """A function that returns the value of an expression at the point.

        It raises SpecError if a name is neither in `substitutions` nor a parameter.
        """
        known = constant_bindings(self.automaton)

        def value_at_point(tree: SyntaxTree) -> Scalar:
            """Return the value of an expression at the point."""
            here = substitute_names(tree, self.substitutions)
            for read in names(here):
                if read.path not in known:
                    label = f"`{read.path}` decides which branch is taken"
                    raise derivative_error(read.span, label, _point_hint(read.path))
            return evaluate(lower_expression(here, known), self.constant_values)

        return value_at_point


def inline_equations(mode: Mode, substitutions: Mapping[str, SyntaxTree]) -> dict[str, SyntaxTree]:
    """Return the equations of a mode in terms of states, inputs and parameters, by name.

    `substitutions` replaces names and is part of the result. Equations of parallel regions are not
    inlined. Raises SpecError if an equation would exceed MAX_INLINED_NODES, since each read copies
    it.
    """
    if exceeds_inlining_limit(mode):
        problems = Problems()
        label = f"the equations of mode `{mode.name}` are too large to be put into each other"
        hint = f"they would have more than {MAX_INLINED_NODES} parts; "
        hint += "write the matrices, or fewer steps"
        problems.error("expression", mode.span, label, hint)
        raise SpecError(problems.reported)
    known = dict(substitutions)
    own = [name for name in equation_order(mode) if name in mode.equations]
    for name in own:  # equations of parallel regions depend on the mode of the region
        known[name] = substitute_names(mode.equations[name].tree, known)
    return known


def exceeds_inlining_limit(mode: Mode) -> bool:
    """Return whether an inlined equation of a mode has more than MAX_INLINED_NODES parts.

    Equations of parallel regions do not count. The size grows fast: 50 equations that each read the
    one before twice give 2^50 parts.
    """
    sizes: dict[str, int] = {}
    for name in equation_order(mode):
        if name in mode.equations:
            formula = mode.equations[name]
            read = sum(sizes.get(path, 0) for path in formula.reads)
            sizes[name] = len(walk(formula.tree)) + read
    return max(sizes.values(), default=0) > MAX_INLINED_NODES


def symbolic_rates(mode: Mode, substitutions: Mapping[str, SyntaxTree]) -> dict[str, SyntaxTree]:
    """Return der(x) of each state of a mode's flow, with `substitutions` applied to both sides.

    It is the right side divided by the coefficient of der(x). Raises SpecError if a balance has no
    such coefficient.
    """
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
    """Return the derivatives of the trees (rows) by the columns at a point.

    The names of the point are replaced by their expressions. Zero entries and empty rows are left
    out. Raises SpecError if a derivative does not exist, or if the point does not decide which
    branch of a condition is taken.
    """
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
    """Return the value of the tangent of a tree where all columns are 0.

    The tangent is taken at the point. Sums and products are split, so only nonlinear terms read the
    point; a tree that reads no column is returned unchanged. Raises SpecError if a nonlinear term
    reads a column without a value at the point.
    """

    def offset_of(part: SyntaxTree) -> SyntaxTree:
        """Return the offset of a part of the tree."""
        return affine_offset(part, columns, point)

    if not _reads_any(tree, columns):
        return tree
    match tree:
        case Name(_, span):
            return make_number(0, span)
        case Negation(operand, _):
            return negate(offset_of(operand))
        case Arithmetic("+", left, right, _):
            return add(offset_of(left), offset_of(right))
        case Arithmetic("-", left, right, _):
            return subtract(offset_of(left), offset_of(right))
        case Arithmetic("*", left, right, _) if not _reads_any(left, columns):
            return multiply(left, offset_of(right))
        case Arithmetic("*", left, right, _) if not _reads_any(right, columns):
            return multiply(offset_of(left), right)
        case Arithmetic("/", left, right, _) if not _reads_any(right, columns):
            return divide(offset_of(left), right)
        case Arithmetic() | Power():
            return _nonlinear_offset(tree, columns, point)
        case FunctionCall(function, _, _) if function in SMOOTH_FUNCTIONS:
            return _nonlinear_offset(tree, columns, point)
        case _:
            return offset_of(select_branch(tree, point.evaluator))


def _reads_any(tree: SyntaxTree, columns: Collection[str]) -> bool:
    """Return whether a tree reads one of the columns."""
    return any(read.path in columns for read in names(tree))


def _nonlinear_offset(
    tree: SyntaxTree, columns: Collection[str], point: LinearisationPoint
) -> SyntaxTree:
    """Return the value of a tree at the point minus the sum of slope * column there."""
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
    """Return the help that asks for the value of a name at the point."""
    return f"give its point: `at: {{{name}: ...}}`"


def sum_affine_terms(slopes: Mapping[str, SyntaxTree], offset: SyntaxTree) -> SyntaxTree:
    """Return the sum of slope * column over all columns, in their order, plus the offset."""
    parts = [multiply(slope, Name(column, offset.span)) for column, slope in slopes.items()]
    return reduce(add, [*parts, offset])


def linearise_model(
    model: Automaton, run: ModelRun, point: LinearisationPoint, problems: Problems
) -> Automaton:
    """Return the model with the flow of each mode replaced by its tangent at the point of a run.

    Linear terms stay as they are; equations and guards are unchanged. `run.linearise` gives the
    point (empty without it); `point` supplies constants only. A mode without a tangent, or with a
    slope that reads more than parameters, is reported and stays as it is.
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
    """Return a mode with an affine flow; SpecError if a slope reads anything but parameters."""
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
        right = sum_affine_terms(slopes.get(state, {}), affine_offset(tree, tuple(flow), point))
        balances[state] = Balance(state, left, right, mode.flow[state].key)
    if problems.has_errors:
        raise SpecError(problems.reported)
    return dataclasses.replace(mode, flow=balances)
