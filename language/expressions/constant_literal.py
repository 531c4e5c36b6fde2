"""Constant literals: the exact value of an expression that consists of numbers with units only."""

from __future__ import annotations

from fractions import Fraction

from language.expressions.syntax_tree import Arithmetic, Negation, NumberLiteral, SyntaxTree
from language.expressions.units import (
    Dimension,
    are_compatible,
    common_dimension,
    dimension_product,
)
from language.text.diagnostic import Problems, SpecError


def evaluate_literal(tree: SyntaxTree) -> tuple[Fraction, Dimension]:
    """Return the exact value in SI and the dimension of an expression of literals.

    The operations are `+ - * /` and unary minus. Raises SpecError for any other part, a name, a
    power or a call included ("constant"), for a division by zero ("value") and for a sum of
    dimensions that are not compatible ("dimension").
    """
    problems = Problems()
    match tree:
        case NumberLiteral(value, unit, _):
            return value, unit.dimension
        case Negation(operand, _):
            value, dimension = evaluate_literal(operand)
            return -value, dimension
        case Arithmetic(operator, left, right, span):
            (a, first), (b, second) = evaluate_literal(left), evaluate_literal(right)
            if operator in "*/":
                if operator == "/" and b == 0:
                    problems.error("value", span, "this divides by zero")
                    raise SpecError(problems.reported)
                value = a * b if operator == "*" else a / b
                return value, dimension_product(first, second, 1 if operator == "*" else -1)
            if are_compatible(first, second):
                return (a + b if operator == "+" else a - b), common_dimension(first, second)
            problems.error("dimension", span, f"`{operator}` joins `{first}` and `{second}`")
        case _:
            problems.error("constant", tree.span, "this is made of numbers with units only")
    raise SpecError(problems.reported)
