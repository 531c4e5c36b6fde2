"""Simplify: sums, products and quotients of expressions without what is exactly 0 or 1.

For derived expressions only: what the user wrote is never rearranged.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from language.problem import Span
from language.syntax import (
    Application,
    Arithmetic,
    Choice,
    Logic,
    Name,
    Negative,
    Not,
    Number,
    Power,
    Relation,
    Tree,
    alike,
)
from language.units import NO_UNIT


def number(value: Fraction | int, span: Span) -> Number:
    """Return a number without a unit: derived expressions are past the check of dimensions."""
    return Number(Fraction(value), NO_UNIT, span)


def plus(a: Tree, b: Tree) -> Tree:
    """Return a + b."""
    if is_zero(a):
        return b
    if is_zero(b):
        return a
    if isinstance(a, Number) and isinstance(b, Number):
        return number(a.value + b.value, a.span)
    if isinstance(b, Negative):
        return minus(a, b.operand)
    return Arithmetic("+", a, b, a.span)


def minus(a: Tree, b: Tree) -> Tree:
    """Return a - b; 0 where both are the same expression."""
    if is_zero(b):
        return a
    if is_zero(a):
        return negative(b)
    if isinstance(a, Number) and isinstance(b, Number):
        return number(a.value - b.value, a.span)
    if alike(a, b):
        return number(0, a.span)
    if isinstance(b, Negative):
        return plus(a, b.operand)
    return Arithmetic("-", a, b, a.span)


def times(a: Tree, b: Tree) -> Tree:
    """Return a b."""
    if is_zero(a) or is_zero(b):
        return number(0, a.span)
    if is_one(a):
        return b
    if is_one(b):
        return a
    if isinstance(a, Number) and isinstance(b, Number):
        return number(a.value * b.value, a.span)
    if isinstance(a, Negative):
        return negative(times(a.operand, b))
    if isinstance(b, Negative):
        return negative(times(a, b.operand))
    return Arithmetic("*", a, b, a.span)


def over(a: Tree, b: Tree) -> Tree:
    """Return a / b."""
    if is_zero(a):
        return number(0, a.span)
    if is_one(b):
        return a
    if isinstance(a, Number) and isinstance(b, Number) and b.value:
        return number(a.value / b.value, a.span)
    if isinstance(a, Negative):
        return negative(over(a.operand, b))
    return Arithmetic("/", a, b, a.span)


def negative(a: Tree) -> Tree:
    """Return -a."""
    if isinstance(a, Number):
        return number(-a.value, a.span)
    if isinstance(a, Negative):
        return a.operand
    return Negative(a, a.span)


def power(a: Tree, exponent: int) -> Tree:
    """Return a^exponent."""
    if exponent == 0:
        return number(1, a.span)
    if exponent == 1:
        return a
    if isinstance(a, Number) and a.value:
        return number(a.value**exponent, a.span)
    return Power(a, exponent, a.span)


def is_zero(tree: Tree) -> bool:
    """Tell whether this is the number 0."""
    return isinstance(tree, Number) and tree.value == 0


def is_one(tree: Tree) -> bool:
    """Tell whether this is the number 1."""
    return isinstance(tree, Number) and tree.value == 1


def replaced(tree: Tree, by: Mapping[str, Tree]) -> Tree:
    """Return the tree with some names replaced, simplified."""

    def inside(part: Tree) -> Tree:
        return replaced(part, by)

    match tree:
        case Name(path, _):
            return by.get(path, tree)
        case Negative(operand, _):
            return negative(inside(operand))
        case Not(operand, span):
            return Not(inside(operand), span)
        case Arithmetic(operator, left, right, _):
            return ARITHMETIC[operator](inside(left), inside(right))
        case Logic(operator, left, right, span):
            return Logic(operator, inside(left), inside(right), span)
        case Relation(operator, left, right, span):
            return Relation(operator, inside(left), inside(right), span)
        case Power(base, exponent, _):
            return power(inside(base), exponent)
        case Choice(condition, then, other, span):
            return Choice(inside(condition), inside(then), inside(other), span)
        case Application("in", _, _):
            return tree
        case Application(function, arguments, span):
            parts = tuple(inside(part) for part in arguments)
            odd = function in ("sin", "tan", "tanh") and is_zero(parts[0])
            return parts[0] if odd else Application(function, parts, span)
        case _:
            return tree


ARITHMETIC = {"+": plus, "-": minus, "*": times, "/": over}
