"""Generator mutants: mistakes in the printed C that lock-step must see."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from codegen.emit import c_expression as printed
from codegen.emit.c_statement import StatementEmitter
from language.ir.number_type import NumberType
from language.ir.ops import Binary, Compare, Expr
from tests.lockstep.random_specs.mutant import Mutant, Patch, attribute, drop_lines


def _reciprocal(whole: Binary, operator: str, left: Expr, right: Expr, place: Any) -> str:
    if operator != "/":
        return _BINARY(whole, operator, left, right, place)
    one = printed.format_literal(1.0, place.number)
    first, second = (printed.emit_expression(operand, place) for operand in (left, right))
    return f"({first}) * ({one} / ({second}))"


def _rough(digits: int) -> Callable[[float, NumberType], str]:
    """A literal of some digits; of float32 as many fewer than it needs."""

    def decimal(value: float, number: NumberType) -> str:
        if not math.isfinite(value):
            return repr(value)
        rough = float(f"{value:.{digits if number == 'float64' else digits - 8}g}")
        return repr(rough if math.isfinite(rough) else value)

    return decimal


def _bare(expr: Expr, place: Any) -> str:
    is_sum = isinstance(expr, Binary) and expr.operator in ("+", "-", "*", "/")
    return printed.emit_expression(expr, place) if is_sum else _OPERAND(expr, place)


def _double(value: float | int | bool, number: NumberType) -> str:
    return _LITERAL(value, "float64" if isinstance(value, float) else number)


def _strict(expr: Expr, place: Any) -> str:
    if isinstance(expr, Compare) and expr.operator == ">=":
        expr = Compare(">", expr.left, expr.right)
    return _EXPRESSION(expr, place)


def _everywhere(name: str, value: Any) -> Patch:
    def apply(patch: pytest.MonkeyPatch) -> None:
        for module in ("c_expression", "c_statement"):
            patch.setattr(f"codegen.emit.{module}.{name}", value)

    return apply


def _short(writer: StatementEmitter, timer: str, condition: Expr, limit: int, *told: str) -> Any:
    return _COUNT(writer, timer, condition, limit - 1, *told)


_COUNT = StatementEmitter._emit_count
_BINARY, _OPERAND, _LITERAL = printed._emit_binary, printed._emit_operand, printed.format_literal
_EXPRESSION = printed.emit_expression

GENERATOR = (
    Mutant(
        "a division is a product",
        "generator",
        attribute("codegen.emit.c_expression._emit_binary", _reciprocal),
    ),
    Mutant(
        "literals have 15 digits",
        "generator",
        attribute("codegen.emit.c_expression.shortest_decimal", _rough(15)),
    ),
    Mutant(
        "literals have 16 digits",
        "generator",
        attribute("codegen.emit.c_expression.shortest_decimal", _rough(16)),
    ),
    Mutant(
        "parentheses are missing",
        "generator",
        attribute("codegen.emit.c_expression._emit_operand", _bare),
    ),
    Mutant(
        "float32 is computed in double",
        "generator",
        attribute("codegen.emit.c_expression.format_literal", _double),
    ),
    Mutant(
        "the relation >= fails on equality",
        "generator",
        _everywhere("emit_expression", _strict),
    ),
    Mutant(
        "a case falls through",
        "generator",
        attribute(
            "codegen.emit.c_statement.StatementEmitter._emit_choose",
            drop_lines("break;")(StatementEmitter._emit_choose),
        ),
    ),
    Mutant(
        "a counter stops one short in C",
        "generator",
        attribute("codegen.emit.c_statement.StatementEmitter._emit_count", _short),
    ),
)
