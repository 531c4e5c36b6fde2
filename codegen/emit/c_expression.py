"""C expressions: prints an expression of a Program in the same order of operations (rule C2)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from codegen.emit.c_names import C_REAL_TYPE
from language.ir.number_type import NumberType, shortest_decimal
from language.ir.ops import Binary, Call, Compare, Expr, Item, Ref, Select, Unary, Value


class CNameMap(Protocol):
    """A mapping from names of a Program to C text, with the number type of its reals."""

    @property
    def number(self) -> NumberType:
        """The number type of the reals."""

    def __call__(self, name: str) -> str:
        """Return the C text of a variable or constant."""

    def integer_constant(self, name: str, number: int) -> str:
        """Return the C text of a number beside a whole-number variable: a mode by its name."""

    def is_unsigned(self, name: str) -> bool:
        """Tell whether a variable is an unsigned integer in C."""

    def is_volatile(self, name: str) -> bool:
        """Tell whether a constant is on a page that another program may change at any time."""


class PlainNames:
    """The part of a CNameMap for names that are reals, and that nobody else changes."""

    def integer_constant(self, name: str, number: int) -> str:
        """Return a whole number as a decimal; `name` is ignored."""
        return str(number)

    def is_unsigned(self, name: str) -> bool:
        """Return False: all names are reals."""
        return False

    def is_volatile(self, name: str) -> bool:
        """Return False: nobody changes them during a step."""
        return False


@dataclass(frozen=True)
class LocalNames(PlainNames):
    """The names inside a function, of which `text_of` gives the C text."""

    text_of: Callable[[str], str]
    number: NumberType = "float64"

    def __call__(self, name: str) -> str:
        """Return the C text of a name."""
        return self.text_of(name)


LIBM_FUNCTIONS: Mapping[str, str] = {"abs": "fabs", "sqrt": "sqrt", "floor": "floor"}
"""Functions of the C library that are exact; all others come from ha_math."""
TABLE_FUNCTIONS = ("lookup", "lookup2")
"""Functions with a table among their arguments."""
MATH_SUFFIX: Mapping[NumberType, str] = {"float64": "", "float32": "f"}
"""The suffix of a C function for a number type: sqrt, sqrtf."""
LOGICAL_OPERATORS: Mapping[str, str] = {"and": "&&", "or": "||"}
"""Logical operators of a Program in C."""
LEFT_ASSOCIATIVE: Mapping[str, str] = {
    **{"+": "+-", "-": "+-", "*": "*/", "/": "*/"},
    **{"and": "and", "or": "or"},
}
"""Operators of a left operand that need no parentheses, by the outer operator: (a + b) - c."""


def emit_expression(expr: Expr, c_names: CNameMap) -> str:
    """Return the C text of an expression on one line.

    Every compound operand is in parentheses, also a unary minus or negative literal; except a left
    operand that C evaluates first anyway (LEFT_ASSOCIATIVE). A comparison of a variable with an
    integer literal uses `integer_constant`. An unsigned variable (a counter, an enumeration), which
    is below 2^31, is cast to int32_t beside a signed operand; a literal that is added to it has the
    suffix U. A lookup in a
    volatile table calls the function of the header ha_page.
    """
    match expr:
        case Value(value):
            return format_literal(value, c_names.number)
        case Ref(name):
            return c_names(name)
        case Item(name, index):
            return f"{c_names(name)}[{emit_expression(index, c_names)}]"
        case Unary("-", operand):
            return f"-{_emit_signed(operand, c_names)}"
        case Unary(_, operand):
            return f"!{_emit_operand(operand, c_names)}"
        case Binary(operator, left, right):
            return _emit_binary(
                expr, LOGICAL_OPERATORS.get(operator, operator), left, right, c_names
            )
        case Compare(operator, left, right):
            if isinstance(left, Ref) and isinstance(right, Value) and type(right.value) is int:
                constant = c_names.integer_constant(left.name, right.value)
                return f"{c_names(left.name)} {operator} {constant}"
            first, second = _emit_matched(left, right, c_names)
            return f"{first} {operator} {second}"
        case Select(condition, then, other):
            first, second = _emit_matched(then, other, c_names)
            return f"{_emit_operand(condition, c_names)} ? {first} : {second}"
        case Call(function, arguments):
            texts = [emit_expression(argument, c_names) for argument in arguments]
            if reads_table(expr, c_names.is_volatile):
                function = f"page_{function}"
            return _emit_call(function, texts, c_names.number)


def reads_table(expr: Expr, is_selected: Callable[[str], bool]) -> bool:
    """Tell whether an expression is a lookup in a table whose name `is_selected` accepts."""
    match expr:
        case Call(function, arguments) if function in TABLE_FUNCTIONS:
            return any(isinstance(one, Ref) and is_selected(one.name) for one in arguments)
    return False


def format_literal(value: float | int | bool, number: NumberType) -> str:
    """Return a literal: `true` or `false`, an integer, or the shortest exact decimal (rule C4).

    The type of `value` decides. The literal of a float ends with F for float32; an integer has no
    suffix.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return repr(value)
    return shortest_decimal(value, number) + MATH_SUFFIX[number].upper()


def _emit_matched(left: Expr, right: Expr, c_names: CNameMap) -> list[str]:
    """Return the C texts of two operands of one type.

    They are unsigned if both are, or if one is and the other is a literal, which then has the
    suffix U; else an unsigned one is cast to int32_t.
    """
    both = (left, right)
    if not _are_unsigned(left, right, c_names):
        return [_emit_signed(one, c_names) for one in both]
    return [_emit_operand(one, c_names) + ("U" if isinstance(one, Value) else "") for one in both]


def _emit_signed(expr: Expr, c_names: CNameMap) -> str:
    """Return the C text of an operand; an unsigned one is cast to int32_t."""
    text = _emit_operand(expr, c_names)
    return f"(int32_t){text}" if _is_unsigned(expr, c_names) else text


def _emit_operand(expr: Expr, c_names: CNameMap) -> str:
    """Return the C text of an operand, in parentheses unless it is a name, call or literal >= 0."""
    text = emit_expression(expr, c_names)
    simple = isinstance(expr, Ref | Item | Call) or (isinstance(expr, Value) and text[0] != "-")
    return text if simple else f"({text})"


def _emit_binary(binary: Binary, operator: str, left: Expr, right: Expr, c_names: CNameMap) -> str:
    """Return the C text of a binary operation; `operator` is its operator in C."""
    if _is_unsigned(binary, c_names):
        return f"{_emit_operand(left, c_names)} {operator} {_emit_operand(right, c_names)}U"
    chained = isinstance(left, Binary) and left.operator in LEFT_ASSOCIATIVE.get(
        binary.operator, ""
    )
    is_first = chained and not _is_unsigned(left, c_names)
    first = emit_expression(left, c_names) if is_first else _emit_signed(left, c_names)
    return f"{first} {operator} {_emit_signed(right, c_names)}"


def _is_unsigned(expr: Expr, c_names: CNameMap) -> bool:
    """Tell whether an expression is unsigned in C.

    It is an unsigned variable, one plus an integer literal, or a choice between these and literals.
    """
    match expr:
        case Ref(name):
            return c_names.is_unsigned(name)
        case Binary("+", Ref(name), Value() as literal):
            return c_names.is_unsigned(name) and _is_natural(literal)
        case Select(_, then, other):
            return _are_unsigned(then, other, c_names)
    return False


def _are_unsigned(left: Expr, right: Expr, c_names: CNameMap) -> bool:
    """Tell whether two operands can have an unsigned type: one is unsigned, the other is so too or
    a literal.
    """
    known = [_is_unsigned(one, c_names) for one in (left, right)]
    return any(known) and all(
        is_known or _is_natural(one) for is_known, one in zip(known, (left, right), strict=True)
    )


def _is_natural(expr: Expr) -> bool:
    """Tell whether an expression is an integer literal of at least 0."""
    return isinstance(expr, Value) and type(expr.value) is int and expr.value >= 0


def _emit_call(function: str, arguments: list[str], number: NumberType) -> str:
    """Return the C text of a function call; `real` becomes a cast."""
    if function == "real":
        return f"({C_REAL_TYPE[number]})({arguments[0]})"
    name = LIBM_FUNCTIONS.get(function, f"ha_{function}") + MATH_SUFFIX[number]
    return f"{name}({', '.join(arguments)})"
