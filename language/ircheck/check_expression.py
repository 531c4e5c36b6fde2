"""Checks of expressions: names exist, types agree, literals and indices are within their ranges."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from language.ir.expression_type import (
    ELEMENTARY_SIGNATURES,
    Signature,
    expression_type,
    real_function,
)
from language.ir.number_type import round_to_type
from language.ir.ops import Binary, Call, Compare, Expr, Item, Ref, Select, Unary, Value
from language.ir.program import Program, ValueType
from language.ircheck.violation import Rule

MIN_WHOLE, MAX_WHOLE = -(2**31), 2**31 - 1
"""Smallest and largest whole number: 32 bits."""
Interval = tuple[int, int]
Report = Callable[[Rule, str], None]
"""A function that gets the rule and the message of each violation."""


class ExpressionChecker:
    """A checker of the expressions of one Program.

    `types` are the types of names, `sizes` the lengths of arrays. `intervals` are the values that
    an index of a loop may have at the current operation.
    """

    def __init__(
        self, program: Program, report: Report, types: dict[str, ValueType] | None = None
    ) -> None:
        self.report = report
        self.number_type = program.number_type
        self.types = program.types() if types is None else types
        self.sizes = {v.name: v.size for v in program.variables if v.size}
        self.sizes |= {c.name: len(c.items) for c in program.constants if c.items}
        self.intervals: dict[str, Interval] = {}
        self.signatures: Mapping[str, Signature] = {
            **ELEMENTARY_SIGNATURES,
            **{f.name: real_function(len(f.parameters)) for f in program.functions},
        }

    def check(self, expr: Expr) -> ValueType:
        """Report the violations of an expression and return its type."""
        match expr:
            case Value():
                self._check_literal(expr)
            case Ref(name):
                self._check_reference(expr)
                if name in self.sizes:
                    self.report("type", f"`{name}` is an array, not a value")
            case Item():
                self._check_reference(expr)
                self._check_index(expr.name, expr.index)
            case Unary(operator, operand):
                kind = self.check(operand)
                if (kind == "truth") != (operator == "not"):
                    self.report("type", f"`{operator}` of a {kind}")
            case Binary(operator, left, right):
                self._check_binary(operator, left, right)
            case Compare(operator, left, right):
                first = self.check(left)
                second = self.check(right)
                if first != second:
                    self.report("type", f"`{operator}` of {first} and {second}")
                elif first == "truth" and operator not in ("==", "!="):
                    self.report("type", f"`{operator}` of truth values")
            case Select(condition, then, other):
                kinds = [self.check(part) for part in (condition, then, other)]
                if kinds[0] != "truth":
                    self.report("type", f"the condition of a choice is {kinds[0]}")
                if kinds[1] != kinds[2]:
                    self.report("type", f"a choice of {kinds[1]} and {kinds[2]}")
            case Call(function, arguments):
                self._check_call(function, arguments)
        return expression_type(expr, self.types)

    def check_element(self, array: str, index: Expr) -> None:
        """Report the violations of an element of an array that is written."""
        self._check_index(array, index)

    def _check_literal(self, literal: Value) -> None:
        """Report the violations of a literal: a real of the number type, a whole of 32 bits."""
        value = literal.value
        if isinstance(value, float):
            rounded = round_to_type(value, self.number_type)
            if value == value and rounded != value:
                self.report("range", f"{value!r} is no {self.number_type}")
        elif not isinstance(value, bool) and not MIN_WHOLE <= value <= MAX_WHOLE:
            self.report("range", f"{value} has more than 32 bits")

    def _check_reference(self, reference: Ref | Item) -> None:
        """Report the violations of a name: it is declared, and the mark of its type agrees."""
        kind = self.types.get(reference.name)
        if kind is None:
            self.report("reference", f"`{reference.name}` is not declared")
        elif (kind == "whole") != reference.is_integer:
            marked = "whole" if reference.is_integer else "not whole"
            message = f"`{reference.name}` is {kind}, but marked as {marked}"
            self.report("type", message)

    def _check_index(self, array: str, index: Expr) -> None:
        """Report the violations of the index of an array."""
        kind = self.check(index)
        if kind != "whole":
            self.report("type", f"the index of `{array}` is {kind}, not whole")
        size = self.sizes.get(array)
        if size is None:
            if array in self.types:
                self.report("type", f"`{array}` is no array")
            return
        interval = self.interval_of(index)
        if interval and not (interval[0] >= 0 and interval[1] < size):
            low, high = interval
            text = f"{low}" if low == high else f"{low} .. {high}"
            self.report("range", f"index {text} of `{array}`, which has {size} elements")

    def interval_of(self, index: Expr) -> Interval | None:
        """Return the smallest and largest value of an index; None if it is not known."""
        match index:
            case Value(value) if type(value) is int:
                return value, value
            case Ref(name):
                return self.intervals.get(name)
            case Binary("+" | "-" as operator, left, right):
                first, second = self.interval_of(left), self.interval_of(right)
                if first is None or second is None:
                    return None
                low, high = second if operator == "+" else (-second[1], -second[0])
                return first[0] + low, first[1] + high
        return None

    def _check_binary(self, operator: str, left: Expr, right: Expr) -> None:
        """Report the violations of an operation of two numbers or two truth values."""
        first = self.check(left)
        second = self.check(right)
        is_logic = operator in ("and", "or")
        if first != second or (first == "truth") != is_logic:
            self.report("type", f"`{operator}` of {first} and {second}")
        elif operator == "/" and first == "whole":
            self.report("type", "`/` of whole numbers")

    def _check_call(self, function: str, arguments: tuple[Expr, ...]) -> None:
        """Report the violations of a call: the function, the number and types of its arguments."""
        known = self.signatures.get(function)
        if known is None:
            self.report("reference", f"there is no function `{function}`")
            return
        if len(arguments) != len(known.parameters):
            counts = f"{len(arguments)} arguments, not {len(known.parameters)}"
            self.report("type", f"`{function}` has {counts}")
            return
        for number, (argument, wanted) in enumerate(
            zip(arguments, known.parameters, strict=True), start=1
        ):
            if wanted == "table":
                if not isinstance(argument, Ref) or argument.name not in self.sizes:
                    message = f"argument {number} of `{function}` is no table"
                    self.report("type", message)
                continue
            kind = self.check(argument)
            if kind != wanted:
                message = f"argument {number} of `{function}` is {kind}, not {wanted}"
                self.report("type", message)
