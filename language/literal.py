"""Literal: an expression made of numbers with units only, exactly."""

from __future__ import annotations

from fractions import Fraction

from language.problem import Problems, SpecError
from language.syntax import Arithmetic, Negative, Number, Tree
from language.units import Dimension, common, fits, product


def constant(tree: Tree) -> tuple[Fraction, Dimension]:
    """Return an expression of literals exactly, with its dimension. Raises SpecError."""
    problems = Problems()
    match tree:
        case Number(value, unit, _):
            return value, unit.dimension
        case Negative(operand, _):
            value, dimension = constant(operand)
            return -value, dimension
        case Arithmetic(operator, left, right, span):
            (a, first), (b, second) = constant(left), constant(right)
            if operator in "*/":
                if operator == "/" and b == 0:
                    problems.error("value", span, "this divides by zero")
                    raise SpecError(problems.found)
                value = a * b if operator == "*" else a / b
                return value, product(first, second, 1 if operator == "*" else -1)
            if fits(first, second):
                return (a + b if operator == "+" else a - b), common(first, second)
            problems.error("dimension", span, f"`{operator}` joins `{first}` and `{second}`")
        case _:
            problems.error("constant", tree.span, "this is made of numbers with units only")
    raise SpecError(problems.found)
