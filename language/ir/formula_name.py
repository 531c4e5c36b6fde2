"""Formula names: readable names and comment texts for the values of expressions."""

from __future__ import annotations

import re

from language.ir.ops import Binary, Call, Compare, Expr, Item, Ref, Select, Unary, Value
from language.ir.program import unqualified_name

MAX_NAME_LENGTH = 32
"""Longest name that is used [characters]; a longer one is replaced by FALLBACK_NAME."""
FALLBACK_NAME = "hoisted"
OPERATOR_WORDS = {"+": "plus", "-": "minus", "/": "per"}
PRECEDENCE = {"+": 1, "-": 1, "*": 2, "/": 2}
EVALUATION_POINT_PREFIX = "at_"
"""Prefix of the names of states and equations that belong to an evaluation point inside a step."""


def formula_name(expr: Expr) -> str:
    """Return an identifier for an expression: `m_g_r_w`, `per_J_v`, `r_w_cubed`, `half_h`.

    Variables lose their group and `at_`. A product joins its names with `_`; sums and quotients
    insert `plus`, `minus` and `per`; a negation starts with `minus` or `not`, a call with its
    function; 0.5 is `half` and 2 is `twice`. The result is FALLBACK_NAME if the expression contains
    a kind without a name (comparison, choice, array element, `and`, `or`), or if the name is longer
    than MAX_NAME_LENGTH or begins with a digit. Names are not unique.
    """
    name = re.sub(r"[^A-Za-z0-9_]+", "_", _build_name(expr)).strip("_")
    return name if len(name) <= MAX_NAME_LENGTH and not name[:1].isdigit() else FALLBACK_NAME


def format_formula(expr: Expr) -> str:
    """Return an expression as infix text with few parentheses: `m * g * r_w`.

    Variable names lose their group and the prefix `at_`, and their dots become `_`; reals have six
    significant digits; a choice is `if a then b else c`, an element `x[i]`. For comments only.
    """
    match expr:
        case Value(value):
            return f"{value:g}" if isinstance(value, float) else str(value).lower()
        case Ref(name):
            return _plain_name(name)
        case Item(name, index):
            return f"{_plain_name(name)}[{format_formula(index)}]"
        case Unary(operator, operand):
            sign = "-" if operator == "-" else "not "
            return f"{sign}{_format_operand(operand, 3)}"
        case Binary("and" | "or" as operator, left, right) | Compare(operator, left, right):
            return f"{_format_operand(left, 3)} {operator} {_format_operand(right, 3)}"
        case Binary(operator, left, right):
            rank = PRECEDENCE[operator]
            return f"{_format_operand(left, rank)} {operator} {_format_operand(right, rank + 1)}"
        case Select(condition, then, other):
            texts = (format_formula(part) for part in (condition, then, other))
            return "if {} then {} else {}".format(*texts)
        case Call(function, arguments):
            return f"{function}({', '.join(format_formula(argument) for argument in arguments)})"


def _format_operand(expr: Expr, precedence: int) -> str:
    """Return an operand as text, in parentheses if needed.

    They are needed if the operand binds weaker than `precedence` or starts with `-`.
    """
    text = format_formula(expr)
    if isinstance(expr, Binary | Compare | Select):
        own = PRECEDENCE.get(expr.operator, 0) if isinstance(expr, Binary) else 0
        return text if own >= precedence else f"({text})"
    return f"({text})" if text.startswith("-") else text


def _build_name(expr: Expr) -> str:
    """Return the name of an expression; a kind without a name gives a text that is too long."""
    match expr:
        case Value(value):
            return {0.5: "half", 2.0: "twice"}.get(float(value), f"{value:g}")
        case Ref(name):
            return _plain_name(name)
        case Unary(operator, operand):
            return f"{'minus' if operator == '-' else operator}_{_build_name(operand)}"
        case Binary("*", left, right):
            return _power_name(expr) or f"{_build_name(left)}_{_build_name(right)}"
        case Binary("/", Value(1.0), right):
            return f"per_{_build_name(right)}"
        case Binary(operator, left, right) if operator in OPERATOR_WORDS:
            return f"{_build_name(left)}_{OPERATOR_WORDS[operator]}_{_build_name(right)}"
        case Call(function, arguments):
            return "_".join([function, *(_build_name(argument) for argument in arguments)])
        case _:
            return "x" * (MAX_NAME_LENGTH + 1)


def _power_name(expr: Binary) -> str | None:
    """Return `x_squared` for `x * x`, `x_cubed` for `x * x * x`, None for another product."""
    match expr:
        case Binary("*", Ref(name), Ref(other)) if name == other:
            return f"{_plain_name(name)}_squared"
        case Binary("*", Binary("*", Ref(name), Ref(other)), Ref(third)) if name == other == third:
            return f"{_plain_name(name)}_cubed"
        case _:
            return None


def _plain_name(name: str) -> str:
    """Return a variable name without its group and without EVALUATION_POINT_PREFIX, dots as `_`."""
    return unqualified_name(name).removeprefix(EVALUATION_POINT_PREFIX).replace(".", "_")
