"""Hoisting: replaces expressions by names of values that are computed elsewhere.

    x = <hoistable> + state.y    ->    x = <name> + state.y

The passes `parameters` and `inputs` decide what is hoistable and where the value is computed.
"""

from __future__ import annotations

from collections.abc import Callable

from language.ir.expression_type import is_whole
from language.ir.formula_name import formula_name
from language.ir.ops import Binary, Block, Call, Expr, Ref, Unary, Value
from language.ir.printer import format_expr
from language.ir.program import Program
from language.ir.rewrite_ops import map_expressions, map_operands, operands

EXCLUDED_BLOCKS = ("derive", "init", "start", "compare_stamps", "latch")
"""Blocks that run once, and the blocks that compute hoisted values."""
CONSTANT_PREFIX = "constant."
"""Prefix of the names of fixed parameters."""


class HoistedValues:
    """The names and expressions of hoisted values."""

    def __init__(self, program: Program) -> None:
        names = [v.name for v in program.variables] + [c.name for c in program.constants]
        names += [f"block.{name}" for name in program.blocks]
        self._used_names = {name.partition(".")[2].lower() for name in names}
        self._names: dict[str, str] = {}
        self.expressions: dict[str, Expr] = {}

    def ref_to(self, group: str, expr: Expr) -> Ref:
        """Return a reference to the hoisted value of an expression, with a new name if needed.

        `group` is the prefix of the name. Equal expressions share one name.
        """
        text = format_expr(expr)
        if text not in self._names:
            base = formula_name(expr)
            name, number = base, 1
            while name.lower() in self._used_names:
                number += 1
                name = f"{base}_{number}"
            self._used_names.add(name.lower())
            self._names[text] = group + name
            self.expressions[group + name] = expr
        return Ref(self._names[text])


def replace_hoistable(
    program: Program,
    is_hoistable_name: Callable[[str], bool | None],
    hoist: Callable[[Expr], Expr],
    reciprocal: Callable[[Expr], Expr | None] = lambda divisor: None,
) -> dict[str, Block]:
    """Return the blocks of a Program with the largest hoistable expressions replaced.

    `is_hoistable_name` returns True if a name is a reason to hoist, None if it permits hoisting,
    False if it prevents it. `hoist` returns the replacement of an expression; `reciprocal` returns
    the inverse of a hoistable divisor or None.
    """

    def visit(expr: Expr) -> tuple[Expr, bool | None]:
        """Return an expression with its parts changed, and whether it can be hoisted itself."""
        match expr:
            case Value():
                return expr, None
            case Ref(name):
                return expr, is_hoistable_name(name)
            case Unary("-") | Binary() | Call():
                inner = [visit(part) for part in operands(expr)]
                kinds = [kind for _, kind in inner]
                if False not in kinds:
                    return expr, True if True in kinds else None
                return _with_changed(expr, inner), False
            case _:
                return map_operands(expr, lambda part: hoist_if_real(*visit(part))), False

    def hoist_if_real(expr: Expr, kind: bool | None) -> Expr:
        """Return the replacement of an expression that can be hoisted and computes a real."""
        return hoist(expr) if kind and is_real_operation(expr) else expr

    def _with_changed(expr: Expr, inner: list[tuple[Expr, bool | None]]) -> Expr:
        """Return an expression with its hoistable operands replaced, a division by a product."""
        if isinstance(expr, Binary) and expr.operator == "/" and inner[1][1]:
            inverse = reciprocal(inner[1][0])
            if inverse is not None:
                return Binary("*", hoist_if_real(*inner[0]), inverse)
        pending = iter(inner)
        return map_operands(expr, lambda _: hoist_if_real(*next(pending)))

    return {
        name: block
        if name in EXCLUDED_BLOCKS
        else map_expressions(block, lambda e: hoist_if_real(*visit(e)))
        for name, block in program.blocks.items()
    }


def is_real_operation(expr: Expr) -> bool:
    """Return whether an expression is arithmetic on reals; a sign alone does not count."""
    if isinstance(expr, Unary):
        return expr.operator == "-" and is_real_operation(expr.operand)
    if isinstance(expr, Binary):
        return expr.operator in "+-*/" and not is_whole(expr)
    return isinstance(expr, Call) and expr.function != "whole"
