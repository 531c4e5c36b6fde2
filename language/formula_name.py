"""Formula name: a readable name for the value of an expression, and its text for a comment."""

from __future__ import annotations

import re

from language.operation import Binary, Call, Compare, Expr, Item, Ref, Select, Unary, Value
from language.program import short

LONGEST = 32
"""Characters of a name that is still read; longer ones are numbered instead."""
NUMBERED = "hoisted"
WORDS = {"+": "plus", "-": "minus", "/": "per"}
RANK = {"+": 1, "-": 1, "*": 2, "/": 2}
POINT = "at_"
"""How the names of equations and states begin where they are values at a point of a step."""


def formula_name(expr: Expr) -> str:
    """Return a name like `m_g_r_w`, `k_hs_per_c_hs`, `per_J_v`, `r_w_cubed`, `half_h`."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", _name(expr)).strip("_")
    return name if len(name) <= LONGEST and not name[:1].isdigit() else NUMBERED


def formula_text(expr: Expr) -> str:
    """Return an expression as it is written: `m * g * r_w`."""
    match expr:
        case Value(value):
            return f"{value:g}" if isinstance(value, float) else str(value).lower()
        case Ref(name):
            return _plain(name)
        case Item(name, index):
            return f"{_plain(name)}[{formula_text(index)}]"
        case Unary(operator, operand):
            sign = "-" if operator == "-" else "not "
            return f"{sign}{_inner(operand, 3)}"
        case Binary("and" | "or" as operator, left, right) | Compare(operator, left, right):
            return f"{_inner(left, 3)} {operator} {_inner(right, 3)}"
        case Binary(operator, left, right):
            rank = RANK[operator]
            return f"{_inner(left, rank)} {operator} {_inner(right, rank + 1)}"
        case Select(condition, then, other):
            texts = (formula_text(part) for part in (condition, then, other))
            return "if {} then {} else {}".format(*texts)
        case Call(function, arguments):
            return f"{function}({', '.join(formula_text(argument) for argument in arguments)})"


def _inner(expr: Expr, rank: int) -> str:
    text = formula_text(expr)
    if isinstance(expr, Binary | Compare | Select):
        own = RANK.get(expr.operator, 0) if isinstance(expr, Binary) else 0
        return text if own >= rank else f"({text})"
    return f"({text})" if text.startswith("-") else text


def _name(expr: Expr) -> str:
    match expr:
        case Value(value):
            return {0.5: "half", 2.0: "twice"}.get(float(value), f"{value:g}")
        case Ref(name):
            return _plain(name)
        case Unary(_, operand):
            return f"minus_{_name(operand)}"
        case Binary("*", left, right):
            return _power(expr) or f"{_name(left)}_{_name(right)}"
        case Binary("/", Value(1.0), right):
            return f"per_{_name(right)}"
        case Binary(operator, left, right) if operator in WORDS:
            return f"{_name(left)}_{WORDS[operator]}_{_name(right)}"
        case Call(function, arguments):
            return "_".join([function, *(_name(argument) for argument in arguments)])
        case _:
            return "x" * (LONGEST + 1)


def _power(expr: Binary) -> str | None:
    match expr:
        case Binary("*", Ref(name), Ref(other)) if name == other:
            return f"{_plain(name)}_squared"
        case Binary("*", Binary("*", Ref(name), Ref(other)), Ref(third)) if name == other == third:
            return f"{_plain(name)}_cubed"
        case _:
            return None


def _plain(name: str) -> str:
    return short(name).removeprefix(POINT).replace(".", "_")
