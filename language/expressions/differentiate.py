"""Differentiation: the exact derivative of an expression with respect to a name, as an expression.

Where an expression has branches (`if`, `abs`, `min`, `max`, `clip`, `sign`, `floor`), the branch
taken at a point is differentiated. If a branch ends exactly at the point, there is no derivative.
Rules: Griewank and Walther, Evaluating Derivatives (2nd ed. 2008), table 2.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction

from language.expressions.simplify import (
    add,
    divide,
    make_number,
    multiply,
    negate,
    raise_to_power,
    subtract,
)
from language.expressions.syntax_tree import (
    Arithmetic,
    BoolLiteral,
    Conditional,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    Power,
    Relation,
    SyntaxTree,
    names,
)
from language.text.diagnostic import Problem, Span, SpecError

PointValue = Callable[[SyntaxTree], float | bool]
"""A function that gives the value of an expression at the point.

It raises SpecError if the expression has no value there.
"""

STRICT_RELATIONS = {"<": "<", "<=": "<", ">": ">", ">=": ">"}
"""The strict relation that equals each relation if both sides differ."""


def differentiate(tree: SyntaxTree, name: str, value_at: PointValue) -> SyntaxTree:
    """Return d tree / d name, simplified; 0 if the name does not occur.

    Every other name counts as constant. `value_at` gives values at the point, which select the
    branch to be differentiated (`select_branch`). Raises SpecError of kind "derivative" where a
    branch ends exactly at the point, and for a function without derivative that reads the name.
    """
    if all(read.path != name for read in names(tree)):
        return make_number(0, tree.span)
    match tree:
        case Name():
            return make_number(1, tree.span)
        case Negation(operand, _):
            return negate(differentiate(operand, name, value_at))
        case Arithmetic(operator, left, right, _):
            return _differentiate_arithmetic(operator, left, right, name, value_at)
        case Power(base, exponent, span):
            inner = raise_to_power(base, exponent - 1)
            outer = multiply(make_number(exponent, span), inner)
            return multiply(outer, differentiate(base, name, value_at))
        case FunctionCall("atan2", (y, x), _):
            turn = subtract(
                multiply(x, differentiate(y, name, value_at)),
                multiply(y, differentiate(x, name, value_at)),
            )
            return divide(turn, add(raise_to_power(x, 2), raise_to_power(y, 2)))
        case FunctionCall("pow", (base, degree), span):
            lower = FunctionCall("pow", (base, subtract(degree, make_number(1, span))), span)
            by_base = multiply(multiply(degree, lower), differentiate(base, name, value_at))
            by_degree = multiply(
                multiply(tree, _call("log", base)), differentiate(degree, name, value_at)
            )
            return add(by_base, by_degree)
        case FunctionCall(function, (argument,), _) if function in OUTER_DERIVATIVES:
            return multiply(
                OUTER_DERIVATIVES[function](argument), differentiate(argument, name, value_at)
            )
        case _:
            return differentiate(select_branch(tree, value_at), name, value_at)


def select_branch(tree: SyntaxTree, value_at: PointValue) -> SyntaxTree:
    """Return the branch that a choice, `abs`, `min`, `max` or `clip` takes at the point.

    `abs` gives its argument or the negation of it; `sign` and `floor` give a number. Raises
    SpecError of kind "derivative" if two compared values are equal at the point (a corner), and for
    an expression without branches.
    """
    match tree:
        case Conditional(condition, then, other, _):
            return then if decide_condition(condition, value_at) else other
        case FunctionCall("abs", (operand,), span):
            return (
                operand
                if _is_less(tree, make_number(0, span), operand, value_at)
                else negate(operand)
            )
        case FunctionCall("sign", (operand,), span):
            return make_number(
                1 if _is_less(tree, make_number(0, span), operand, value_at) else -1, span
            )
        case FunctionCall("floor", (operand,), span):
            below = make_number(math.floor(value_at(operand)), span)
            _is_less(tree, below, operand, value_at)
            return below
        case FunctionCall("min", (left, right), _):
            return left if _is_less(tree, left, right, value_at) else right
        case FunctionCall("max", (left, right), _):
            return right if _is_less(tree, left, right, value_at) else left
        case FunctionCall("clip", (operand, low, high), _):
            if _is_less(tree, operand, low, value_at):
                return low
            return high if _is_less(tree, high, operand, value_at) else operand
        case FunctionCall(function, _, span):
            raise derivative_error(span, f"`{function}` has no derivative here")
        case _:
            raise derivative_error(tree.span, "this has no derivative")


def decide_condition(condition: SyntaxTree, value_at: PointValue) -> bool:
    """Return the truth of a condition at the point; both sides of `and` and `or` are evaluated.

    Conditions without an order relation (`==`, `in(...)`, names) have the value of `value_at`.
    Raises SpecError of kind "derivative" if both sides of an order relation in it are equal at the
    point.
    """
    match condition:
        case BoolLiteral(value, _):
            return value
        case Not(operand, _):
            return not decide_condition(operand, value_at)
        case Logic(operator, left, right, _):
            sides = decide_condition(left, value_at), decide_condition(right, value_at)
            return all(sides) if operator == "and" else any(sides)
        case Relation(operator, left, right, span) if operator in STRICT_RELATIONS:
            a, b = float(value_at(left)), float(value_at(right))
            if a == b:
                raise derivative_error(
                    span, "both sides are equal at the point: no derivative there"
                )
            return (a < b) == (STRICT_RELATIONS[operator] == "<")
        case _:
            return bool(value_at(condition))


def derivative_error(span: Span, label: str, help: str = "") -> SpecError:
    """Return a SpecError with one problem of kind "derivative" at `span`; it is not raised."""
    return SpecError([Problem("derivative", span, label, help)])


def _differentiate_arithmetic(
    operator: str, left: SyntaxTree, right: SyntaxTree, name: str, value_at: PointValue
) -> SyntaxTree:
    """Return the derivative of a sum, difference, product or quotient."""
    a, b = differentiate(left, name, value_at), differentiate(right, name, value_at)
    match operator:
        case "+":
            return add(a, b)
        case "-":
            return subtract(a, b)
        case "*":
            return add(multiply(a, right), multiply(left, b))
        case _:
            return divide(subtract(a, multiply(divide(left, right), b)), right)


def _is_less(tree: FunctionCall, left: SyntaxTree, right: SyntaxTree, value_at: PointValue) -> bool:
    """Return whether left < right at the point.

    Raises SpecError at the span of `tree` if they are equal.
    """
    a, b = float(value_at(left)), float(value_at(right))
    if a == b:
        label = f"`{tree.function}` has its corner exactly at the point: no derivative there"
        raise derivative_error(tree.span, label, "choose another point in `at`")
    return a < b


def _call(function: str, argument: SyntaxTree) -> SyntaxTree:
    """Return the call of a function with one argument."""
    return FunctionCall(function, (argument,), argument.span)


def _exp_derivative(u: SyntaxTree) -> SyntaxTree:
    """Return the derivative of exp at u."""
    return _call("exp", u)


def _sqrt_derivative(u: SyntaxTree) -> SyntaxTree:
    """Return the derivative of sqrt at u, 1/2 / sqrt(u)."""
    return divide(make_number(Fraction(1, 2), u.span), _call("sqrt", u))


def _tanh_derivative(u: SyntaxTree) -> SyntaxTree:
    """Return the derivative of tanh at u, 1 - tanh(u)^2."""
    return subtract(make_number(1, u.span), raise_to_power(_call("tanh", u), 2))


OUTER_DERIVATIVES: Mapping[str, Callable[[SyntaxTree], SyntaxTree]] = {
    "sin": lambda u: _call("cos", u),
    "cos": lambda u: negate(_call("sin", u)),
    "exp": _exp_derivative,
    "log": lambda u: divide(make_number(1, u.span), u),
    "tanh": _tanh_derivative,
    "sqrt": _sqrt_derivative,
    "tan": lambda u: add(make_number(1, u.span), raise_to_power(_call("tan", u), 2)),
}
"""Derivative of each smooth function of one argument, as a function of the argument's tree."""
SMOOTH_FUNCTIONS = {*OUTER_DERIVATIVES, "atan2", "pow"}
"""Functions that have a derivative without a selection of branches."""
