"""Operations: how often a run executed each kind of operation, expression and function."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, get_args

import pytest

from engine.actions import Action
from engine.closures import Compiler
from engine.shapes import Read
from language.evaluate import ELEMENTARY, OPERATIONS
from language.functions import FUNCTIONS
from language.operation import Assign, Binary, Call, Compare, Expr, Op, Unary
from language.program import Program
from tests.lockstep.chance.running import taped
from tests.lockstep.chance.spec import Spec

KINDS = (
    *(kind.__name__ for kind in get_args(Op)),
    *(kind.__name__ for kind in get_args(Expr)),
    *OPERATIONS,
    "not",
    *(f"call {name}" for name in (*ELEMENTARY, *FUNCTIONS)),
)


def executed(spec: Spec, program: Program, ticks: int) -> Counter[str]:
    """Return how often each kind was executed in some ticks."""
    counts: Counter[str] = Counter()

    class Counting(Compiler):
        def _slot(self, expr: Expr) -> None:
            """Let no operand be read without a function of its own."""

        def _row(self, row: Sequence[Assign]) -> Action:
            return _counting(super()._row(row), counts, "Assign", len(row))

        def _action(self, op: Op) -> Action:
            return _counting(super()._action(op), counts, type(op).__name__)

        def _read(self, expr: Expr) -> Read:
            read = _counting(super()._read(expr), counts, type(expr).__name__)
            name = _name(expr)
            return _counting(read, counts, name) if name else read

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("engine.interpreter._closures_of", lambda same: Counting(same.program))
        taped(spec, program, ticks)
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
