"""Random Programs: the interpreter and the compiled C agree on every bit of every tick."""

from __future__ import annotations

from typing import get_args

import pytest
from hypothesis import HealthCheck, Phase, given, note, settings, strategies as st

from language.ir.number_type import NUMBER_TYPES
from language.ir.ops import Assign, Expr, Op
from language.ir.printer import format_expr
from language.ir.program import Program
from language.ir.traversal import called_functions, walk_ops
from language.numerics.evaluate import BINARY_OPERATIONS, ELEMENTARY
from language.numerics.function_table import FUNCTIONS
from lockstep.comparison import compare
from tests.lockstep.program_strategies import Tick, programs, record_ticks, ticks

SHARE = 2
"""A program has some fifty expressions: it needs fewer examples than other properties."""
LARGE = (HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example)


def operations(program: Program) -> list[Op]:
    return [op for block in program.blocks.values() for op in walk_ops(block)]


@settings(max_examples=settings().max_examples // SHARE, suppress_health_check=LARGE)
@given(st.sampled_from(NUMBER_TYPES).flatmap(programs), ticks())
def test_interpreter_and_c_agree_on_every_bit(program: Program, inputs: list[Tick]) -> None:
    verdict = compare(record_ticks(program, inputs))
    signal = verdict.first.signal if verdict.first else None
    for op in operations(program):
        if isinstance(op, Assign) and op.target.partition(".")[2] == signal:
            note(f"{op.target} := {format_expr(op.value)}")
    assert verdict.is_equal, str(verdict.first)
    assert verdict.ticks == len(inputs)


@pytest.mark.long
def test_random_programs_hold_every_kind_of_operation() -> None:
    """What no random program holds, their agreement says nothing about."""
    kinds: set[str] = set()

    @settings(
        max_examples=12,
        phases=[Phase.generate],
        suppress_health_check=LARGE,
        derandomize=True,
        database=None,
    )
    @given(programs())
    def look(program: Program) -> None:
        text = repr(program.blocks)
        kinds.update(kind.__name__ for kind in get_args(Op) + get_args(Expr) if kind_in(kind, text))
        kinds.update(operator for operator in BINARY_OPERATIONS if f"operator='{operator}'" in text)
        kinds.update(called_functions(program.blocks.values()))

    look()
    wanted = {kind.__name__ for kind in get_args(Op) + get_args(Expr)} | {*BINARY_OPERATIONS}
    wanted |= {name for name in (*ELEMENTARY, *FUNCTIONS) if "lookup" not in name}
    assert wanted <= kinds, wanted - kinds


def kind_in(kind: type, text: str) -> bool:
    return f"{kind.__name__}(" in text
