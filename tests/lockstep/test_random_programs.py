"""Random Programs: the interpreter and the compiled C agree on every bit of every tick."""

from __future__ import annotations

from hypothesis import HealthCheck, given, note, settings

from language.printing import expr_text
from language.program import Assign, Program
from language.wiring import walk
from lockstep.compare import compare
from tests.lockstep.programs import Tick, programs, taped, ticks

COMPILED = settings(
    max_examples=settings().max_examples,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@COMPILED
@given(programs(), ticks())
def test_interpreter_and_c_agree_on_every_bit(program: Program, inputs: list[Tick]) -> None:
    verdict = compare(taped(program, inputs))
    if verdict.first:
        note(f"{verdict.first}")
        for op in walk(tuple(op for block in program.blocks.values() for op in block)):
            if isinstance(op, Assign) and op.target.endswith(f".{verdict.first.signal}"):
                note(f"{op.target} := {expr_text(op.value)}")
    assert verdict.is_equal, str(verdict.first)
    assert verdict.ticks == len(inputs)
