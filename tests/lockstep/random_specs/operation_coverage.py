"""Operations: how often a run executed each kind of operation, expression and function."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, get_args

import pytest

from engine.interpreter.block_compiler import BlockCompiler
from engine.interpreter.expression_closures import ExpressionClosure
from engine.interpreter.statement_closures import StatementClosure
from language.ir.ops import Assign, Binary, Call, Compare, Expr, Op, Unary
from language.ir.program import Program
from language.numerics.evaluate import BINARY_OPERATIONS, ELEMENTARY
from language.numerics.function_table import FUNCTIONS
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.spec import Spec

KINDS = (
    *(kind.__name__ for kind in get_args(Op)),
    *(kind.__name__ for kind in get_args(Expr)),
    *BINARY_OPERATIONS,
    "not",
    *(f"call {name}" for name in (*ELEMENTARY, *FUNCTIONS)),
)


def count_executed(spec: Spec, program: Program, ticks: int) -> Counter[str]:
    """Return how often each kind was executed in some ticks."""
    counts: Counter[str] = Counter()

    class Counting(BlockCompiler):
        def _operand_slot(self, expr: Expr) -> None:
            """Let no operand be read without a function of its own."""

        def _compile_assignments(self, row: Sequence[Assign]) -> StatementClosure:
            return _counting(super()._compile_assignments(row), counts, "Assign", len(row))

        def _compile_operation(self, op: Op) -> StatementClosure:
            return _counting(super()._compile_operation(op), counts, type(op).__name__)

        def _compile_expression(self, expr: Expr) -> ExpressionClosure:
            read = _counting(super()._compile_expression(expr), counts, type(expr).__name__)
            name = _name(expr)
            return _counting(read, counts, name) if name else read

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("engine.interpreter.interpreter._compile_program", Counting)
        record_ticks(spec, program, ticks)
    return counts


def _name(expr: Expr) -> str:
    if isinstance(expr, Binary | Compare | Unary):
        return expr.operator
    return f"call {expr.function}" if isinstance(expr, Call) else ""


def _counting(
    run: Callable[[Any], Any], counts: Counter[str], key: str, times: int = 1
) -> Callable[[Any], Any]:
    def counted(frame: Any) -> Any:
        counts[key] += times
        return run(frame)

    return counted
