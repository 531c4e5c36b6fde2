"""Linear: the balances of a mode as rates, and their matrices at a point, as expressions."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import reduce

from language.balance import coefficient_of
from language.derivative import SMOOTH, At, derivative, refused, taken
from language.evaluate import Scalar, evaluate
from language.lower import expression
from language.model import Automaton, Mode
from language.order import equation_order
from language.parameter import constant_names
from language.problem import Problems, SpecError
from language.simplify import is_zero, minus, negative, number, over, plus, replaced, times
from language.syntax import Application, Arithmetic, Name, Negative, Power, Tree, names, walk

MOST_PARTS = 20_000
"""Names, numbers and operations of an equation with all others put in; those shipped have 100."""
Rows = dict[str, dict[str, Tree]]
"""A matrix by the names of its rows and columns, zeros left out."""


@dataclass(frozen=True)
class Point:
    """Where a flow is made linear: some names with their values, as expressions.

    `values` are those of the constants of `automaton`, whose parameters the values may read.
    """

    automaton: Automaton
    values: Mapping[str, Scalar]
    places: Mapping[str, Tree]

    @property
    def value(self) -> At:
        """The value of an expression at the point. Raises SpecError where a name has none."""
        known = constant_names(self.automaton)

        def at(tree: Tree) -> Scalar:
            here = replaced(tree, self.places)
            for read in names(here):
                if read.path not in known:
                    label = f"`{read.path}` decides which branch is taken"
                    raise refused(read.span, label, _give(read.path))
            return evaluate(expression(here, known), self.values)

        return at


def inlined(mode: Mode, given: Mapping[str, Tree]) -> dict[str, Tree]:
    """Return the equations of a mode in states, inputs and parameters; some names are given.

    Raises SpecError where they would be too large: each read of an equation copies it.
    """
    if is_too_large(mode):
        problems = Problems()
        label = f"the equations of mode `{mode.name}` are too large to be put into each other"
        hint = f"they would have more than {MOST_PARTS} parts; write the matrices, or fewer steps"
        problems.error("expression", mode.span, label, hint)
        raise SpecError(problems.found)
    known = dict(given)
    own = [name for name in equation_order(mode) if name in mode.equations]
    for name in own:  # those of a region beside are not known: its mode chooses them
        known[name] = replaced(mode.equations[name].tree, known)
    return known


def is_too_large(mode: Mode) -> bool:
    """Tell whether the equations of a mode, put into each other, have more parts than are handled.

    An equation that is read twice by the next, and so on 50 times, would have 2^50 parts.
    """
    sizes: dict[str, int] = {}
    for name in equation_order(mode):
        if name in mode.equations:
            formula = mode.equations[name]
            read = sum(sizes.get(path, 0) for path in formula.reads)
            sizes[name] = len(walk(formula.tree)) + read
    return max(sizes.values(), default=0) > MOST_PARTS


def rates(mode: Mode, known: Mapping[str, Tree]) -> dict[str, Tree]:
    """Return der(x) of every state of a mode, with what is known put in."""
    found = {}
    for name, balance in mode.flow.items():
        factor = coefficient_of(balance.left, name)
        if isinstance(factor, SpecError):
            raise factor
        right = replaced(balance.right, known)
        found[name] = right if factor is None else over(right, replaced(factor, known))
    return found


def matrix(trees: Mapping[str, Tree], columns: Iterable[str], point: Point) -> Rows:
    """Return the derivatives of the trees (rows) by the columns at the point. Raises SpecError."""
    found: Rows = {}
    columns = tuple(columns)
    for row, tree in trees.items():
        entries = {}
        for column in columns:
            entry = replaced(derivative(tree, column, point.value), point.places)
            if not is_zero(entry):
                entries[column] = entry
        if entries:
            found[row] = entries
    return found


def remains(tree: Tree, columns: Collection[str], point: Point) -> Tree:
    """Return what the tangent of a tree has besides slope * column: its value where these are 0.

    Sums are taken apart, so that only the terms that are not linear read the point.
    """

    def inside(part: Tree) -> Tree:
        return remains(part, columns, point)

    if not _reads(tree, columns):
        return tree
    match tree:
        case Name(_, span):
            return number(0, span)
        case Negative(operand, _):
            return negative(inside(operand))
        case Arithmetic("+", left, right, _):
            return plus(inside(left), inside(right))
        case Arithmetic("-", left, right, _):
            return minus(inside(left), inside(right))
        case Arithmetic("*", left, right, _) if not _reads(left, columns):
            return times(left, inside(right))
        case Arithmetic("*", left, right, _) if not _reads(right, columns):
            return times(inside(left), right)
        case Arithmetic("/", left, right, _) if not _reads(right, columns):
            return over(inside(left), right)
        case Arithmetic() | Power():
            return _curved(tree, columns, point)
        case Application(function, _, _) if function in SMOOTH:
            return _curved(tree, columns, point)
        case _:
            return inside(taken(tree, point.value))


def _reads(tree: Tree, columns: Collection[str]) -> bool:
    return any(read.path in columns for read in names(tree))


def _curved(tree: Tree, columns: Collection[str], point: Point) -> Tree:
    """The value at the point less slope * column there."""
    result = replaced(tree, point.places)
    for column in dict.fromkeys(read.path for read in names(tree) if read.path in columns):
        if column not in point.places:
            raise refused(tree.span, f"`{column}` does not enter linearly here", _give(column))
        slope = replaced(derivative(tree, column, point.value), point.places)
        result = minus(result, times(slope, point.places[column]))
    return result


def _give(name: str) -> str:
    return f"give its point: `at: {{{name}: ...}}`"


def tangent(slopes: Mapping[str, Tree], rest: Tree) -> Tree:
    """Return the sum of slope * column, plus the rest."""
    parts = [times(slope, Name(column, rest.span)) for column, slope in slopes.items()]
    return reduce(plus, [*parts, rest])
