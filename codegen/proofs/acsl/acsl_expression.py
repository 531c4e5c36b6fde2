"""ACSL expressions: prints expressions of a Program as terms and predicates of Frama-C's contracts.

Reals of ACSL have no rounding, as in the memory model of WP in which contracts are proven. Calls of
functions of `ha_math` have no translation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from codegen.emit.c_expression import format_literal
from language.ir.expression_type import expression_type
from language.ir.number_type import NumberType
from language.ir.ops import Binary, Call, Compare, Expr, Item, Ref, Select, Unary, Value
from language.ir.program import ValueType

Look = Callable[[str], str]
"""A function from a variable to its text: a predicate for a truth value, else a term."""
LOGIC = {"and": "&&", "or": "||"}


class Unsaid(Exception):
    """An expression has no translation to ACSL."""


@dataclass(frozen=True)
class Speech:
    """A printer of expressions, given the number type and the types of names."""

    number: NumberType
    types: Mapping[str, ValueType]

    def predicate(self, expr: Expr, look: Look) -> str:
        """Return a truth value as a predicate. Raises Unsaid."""
        match expr:
            case Value(value):
                return "\\true" if value else "\\false"
            case Ref(name):
                return look(name)
            case Unary("not", operand):
                return f"!({self.predicate(operand, look)})"
            case Binary(operator, left, right):
                first, second = (self.predicate(side, look) for side in (left, right))
                return f"(({first}) {LOGIC[operator]} ({second}))"
            case Compare(operator, left, right) if self.is_truth(left) or self.is_truth(right):
                first, second = (self.predicate(side, look) for side in (left, right))
                same = f"(({first}) <==> ({second}))"
                return same if operator == "==" else f"!{same}"
            case Compare(operator, left, right):
                return f"({self.term(left, look)} {operator} {self.term(right, look)})"
            case Select(condition, then, other):
                parts = [self.predicate(part, look) for part in (condition, then, other)]
                return "(({}) ? ({}) : ({}))".format(*parts)
        raise Unsaid(expr)

    def term(self, expr: Expr, look: Look) -> str:
        """Return a number as a term. Raises Unsaid."""
        match expr:
            case Value():
                text = format_literal(expr.round_to_type(self.number).value, self.number)
                return f"({text})" if text[0] == "-" else text
            case Ref(name):
                return look(name)
            case Item(name, index):
                return f"{look(name)}[{self.term(index, look)}]"
            case Unary("-", operand):
                return f"(-{self.term(operand, look)})"
            case Binary(operator, left, right):
                return f"({self.term(left, look)} {operator} {self.term(right, look)})"
            case Select(condition, then, other):
                test = self.predicate(condition, look)
                return f"(({test}) ? {self.term(then, look)} : {self.term(other, look)})"
            case Call("real", (argument,)):
                return self.term(argument, look)
        raise Unsaid(expr)

    def is_truth_name(self, name: str) -> bool:
        """Tell whether a variable or constant is a truth value; an unknown name is none."""
        return self.types.get(name) == "truth"

    def is_truth(self, expr: Expr) -> bool:
        """Tell whether an expression is a truth value."""
        return expression_type(expr, self.types) == "truth"
