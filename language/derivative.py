"""Derivative: of an expression with respect to a name, as an expression; exact, no differences.

Where an expression has branches (`if`, `abs`, `min`, `max`, `clip`, `sign`, `floor`) the one taken
at a point is differentiated. Where a branch ends exactly at the point there is no derivative.
Rules: Griewank and Walther, Evaluating Derivatives (2nd ed. 2008), table 2.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction

from language.problem import Problems, Span, SpecError
from language.simplify import minus, negative, number, over, plus, power, times
from language.syntax import (
    Application,
    Arithmetic,
    Choice,
    Logic,
    Name,
    Negative,
    Not,
    Power,
    Relation,
    Tree,
    Truth,
    names,
)

At = Callable[[Tree], float | bool]
"""The value of an expression at the point. Raises SpecError where it has none there."""

CONDITIONS = {"<": "<", "<=": "<", ">": ">", ">=": ">"}


def derivative(tree: Tree, name: str, at: At) -> Tree:
    """Return d tree / d name, simplified. Raises SpecError where there is none at the point."""
    if all(read.path != name for read in names(tree)):
        return number(0, tree.span)
    match tree:
        case Name():
            return number(1, tree.span)
        case Negative(operand, _):
            return negative(derivative(operand, name, at))
        case Arithmetic(operator, left, right, _):
            return _arithmetic(operator, left, right, name, at)
        case Power(base, exponent, span):
            inner = power(base, exponent - 1)
            outer = times(number(exponent, span), inner)
            return times(outer, derivative(base, name, at))
        case Application("atan2", (y, x), _):
            turn = minus(times(x, derivative(y, name, at)), times(y, derivative(x, name, at)))
            return over(turn, plus(power(x, 2), power(y, 2)))
        case Application("pow", (base, degree), span):
            lower = Application("pow", (base, minus(degree, number(1, span))), span)
            by_base = times(times(degree, lower), derivative(base, name, at))
            by_degree = times(times(tree, _call("log", base)), derivative(degree, name, at))
            return plus(by_base, by_degree)
        case Application(function, (argument,), _) if function in OUTER:
            return times(OUTER[function](argument), derivative(argument, name, at))
        case _:
            return derivative(taken(tree, at), name, at)


def taken(tree: Tree, at: At) -> Tree:
    """Return the branch that an expression takes at the point. Raises SpecError on its corner."""
    match tree:
        case Choice(condition, then, other, _):
            return then if decided(condition, at) else other
        case Application("abs", (operand,), span):
            return operand if _less(tree, number(0, span), operand, at) else negative(operand)
        case Application("sign", (operand,), span):
            return number(1 if _less(tree, number(0, span), operand, at) else -1, span)
        case Application("floor", (operand,), span):
            below = number(math.floor(at(operand)), span)
            _less(tree, below, operand, at)
            return below
        case Application("min", (left, right), _):
            return left if _less(tree, left, right, at) else right
        case Application("max", (left, right), _):
            return right if _less(tree, left, right, at) else left
        case Application("clip", (operand, low, high), _):
            if _less(tree, operand, low, at):
                return low
            return high if _less(tree, high, operand, at) else operand
        case Application(function, _, span):
            raise refused(span, f"`{function}` has no derivative here")
        case _:
            raise refused(tree.span, "this has no derivative")


def decided(condition: Tree, at: At) -> bool:
    """Return a condition at the point. Raises SpecError where it changes exactly there."""
    match condition:
        case Truth(value, _):
            return value
        case Not(operand, _):
            return not decided(operand, at)
        case Logic(operator, left, right, _):
            sides = decided(left, at), decided(right, at)
            return all(sides) if operator == "and" else any(sides)
        case Relation(operator, left, right, span) if operator in CONDITIONS:
            a, b = float(at(left)), float(at(right))
            if a == b:
                raise refused(span, "both sides are equal at the point: no derivative there")
            return (a < b) == (CONDITIONS[operator] == "<")
        case _:
            return bool(at(condition))


def refused(span: Span, label: str, help: str = "") -> SpecError:
    """Return the error of an expression that cannot be differentiated at the point."""
    problems = Problems()
    problems.error("derivative", span, label, help)
    return SpecError(problems.found)


def _arithmetic(operator: str, left: Tree, right: Tree, name: str, at: At) -> Tree:
    a, b = derivative(left, name, at), derivative(right, name, at)
    match operator:
        case "+":
            return plus(a, b)
        case "-":
            return minus(a, b)
        case "*":
            return plus(times(a, right), times(left, b))
        case _:
            return over(minus(a, times(over(left, right), b)), right)


def _less(tree: Application, left: Tree, right: Tree, at: At) -> bool:
    a, b = float(at(left)), float(at(right))
    if a == b:
        label = f"`{tree.function}` has its corner exactly at the point: no derivative there"
        raise refused(tree.span, label, "choose another point in `at`")
    return a < b


def _call(function: str, argument: Tree) -> Tree:
    return Application(function, (argument,), argument.span)


def _exp(u: Tree) -> Tree:
    return _call("exp", u)


def _root(u: Tree) -> Tree:
    return over(number(Fraction(1, 2), u.span), _call("sqrt", u))


def _bell(u: Tree) -> Tree:
    return minus(number(1, u.span), power(_call("tanh", u), 2))


OUTER: Mapping[str, Callable[[Tree], Tree]] = {
    "sin": lambda u: _call("cos", u),
    "cos": lambda u: negative(_call("sin", u)),
    "exp": _exp,
    "log": lambda u: over(number(1, u.span), u),
    "tanh": _bell,
    "sqrt": _root,
    "tan": lambda u: plus(number(1, u.span), power(_call("tan", u), 2)),
}
"""Derivative of each smooth function of one argument."""
SMOOTH = {*OUTER, "atan2", "pow"}
