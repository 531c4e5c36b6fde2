"""Simplification: sums, products and quotients without terms that are exactly 0 or 1.

The functions build derived expressions; expressions of the user are never rearranged. A result has
the span of the first operand.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from language.expressions.syntax_tree import (
    Arithmetic,
    Conditional,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    NumberLiteral,
    Power,
    Relation,
    SyntaxTree,
)
from language.expressions.units import NO_UNIT
from language.text.diagnostic import Span


def make_number(value: Fraction | int, span: Span) -> NumberLiteral:
    """Return a number without a unit, for derived expressions, whose units nobody checks."""
    return NumberLiteral(Fraction(value), NO_UNIT, span)


def add(a: SyntaxTree, b: SyntaxTree) -> SyntaxTree:
    """Return a + b; without a zero, with numbers added, `a + -b` as `a - b`.

    Of two zeros the second one is returned.
    """
    if is_zero(a):
        return b
    if is_zero(b):
        return a
    if isinstance(a, NumberLiteral) and isinstance(b, NumberLiteral):
        return make_number(a.value + b.value, a.span)
    if isinstance(b, Negation):
        return subtract(a, b.operand)
    return Arithmetic("+", a, b, a.span)


def subtract(a: SyntaxTree, b: SyntaxTree) -> SyntaxTree:
    """Return a - b; without a zero, with numbers subtracted, 0 if both are the same expression.

    `0 - b` becomes `-b`, and `a - -b` becomes `a + b`.
    """
    if is_zero(b):
        return a
    if is_zero(a):
        return negate(b)
    if isinstance(a, NumberLiteral) and isinstance(b, NumberLiteral):
        return make_number(a.value - b.value, a.span)
    if a == b:
        return make_number(0, a.span)
    if isinstance(b, Negation):
        return add(a, b.operand)
    return Arithmetic("-", a, b, a.span)


def multiply(a: SyntaxTree, b: SyntaxTree) -> SyntaxTree:
    """Return a * b; 0 if a factor is 0, without a factor of 1, with a negation moved in front.

    Two numbers are multiplied.
    """
    if is_zero(a) or is_zero(b):
        return make_number(0, a.span)
    if is_one(a):
        return b
    if is_one(b):
        return a
    if isinstance(a, NumberLiteral) and isinstance(b, NumberLiteral):
        return make_number(a.value * b.value, a.span)
    if isinstance(a, Negation):
        return negate(multiply(a.operand, b))
    if isinstance(b, Negation):
        return negate(multiply(a, b.operand))
    return Arithmetic("*", a, b, a.span)


def divide(a: SyntaxTree, b: SyntaxTree) -> SyntaxTree:
    """Return a / b; 0 if a is 0, a if b is 1, with a negation of a in front of the quotient.

    Two numbers are divided, unless the divisor is 0; a quotient by 0 stays an expression (if a is
    not 0).
    """
    if is_zero(a):
        return make_number(0, a.span)
    if is_one(b):
        return a
    if isinstance(a, NumberLiteral) and isinstance(b, NumberLiteral) and b.value:
        return make_number(a.value / b.value, a.span)
    if isinstance(a, Negation):
        return negate(divide(a.operand, b))
    return Arithmetic("/", a, b, a.span)


def negate(a: SyntaxTree) -> SyntaxTree:
    """Return -a; the negation of a number is a number, a double negation is removed."""
    if isinstance(a, NumberLiteral):
        return make_number(-a.value, a.span)
    if isinstance(a, Negation):
        return a.operand
    return Negation(a, a.span)


def raise_to_power(a: SyntaxTree, exponent: int) -> SyntaxTree:
    """Return a^exponent; 1 for exponent 0, a for exponent 1, a number if a is a nonzero number.

    Another power of the number 0 stays an expression.
    """
    if exponent == 0:
        return make_number(1, a.span)
    if exponent == 1:
        return a
    if isinstance(a, NumberLiteral) and a.value:
        return make_number(a.value**exponent, a.span)
    return Power(a, exponent, a.span)


def is_zero(tree: SyntaxTree) -> bool:
    """Return whether a tree is the literal 0, with or without a unit."""
    return isinstance(tree, NumberLiteral) and tree.value == 0


def is_one(tree: SyntaxTree) -> bool:
    """Return whether a tree is a literal whose value in SI is 1, with or without a unit."""
    return isinstance(tree, NumberLiteral) and tree.value == 1


def substitute_names(tree: SyntaxTree, replacements: Mapping[str, SyntaxTree]) -> SyntaxTree:
    """Return the tree with names replaced by trees, its arithmetic simplified.

    A path is replaced as a whole, and replacements are not searched for names again. Names without
    a replacement and those inside `in(...)` are kept. `sin`, `tan` and `tanh` of 0 become 0.
    """

    def inside(part: SyntaxTree) -> SyntaxTree:
        return substitute_names(part, replacements)

    match tree:
        case Name(path, _):
            return replacements.get(path, tree)
        case Negation(operand, _):
            return negate(inside(operand))
        case Not(operand, span):
            return Not(inside(operand), span)
        case Arithmetic(operator, left, right, _):
            return SIMPLIFYING_OPERATIONS[operator](inside(left), inside(right))
        case Logic(operator, left, right, span):
            return Logic(operator, inside(left), inside(right), span)
        case Relation(operator, left, right, span):
            return Relation(operator, inside(left), inside(right), span)
        case Power(base, exponent, _):
            return raise_to_power(inside(base), exponent)
        case Conditional(condition, then, other, span):
            return Conditional(inside(condition), inside(then), inside(other), span)
        case FunctionCall("in", _, _):
            return tree
        case FunctionCall(function, arguments, span):
            parts = tuple(inside(part) for part in arguments)
            odd = function in ("sin", "tan", "tanh") and is_zero(parts[0])
            return parts[0] if odd else FunctionCall(function, parts, span)
        case _:
            return tree


SIMPLIFYING_OPERATIONS = {"+": add, "-": subtract, "*": multiply, "/": divide}
