"""Healthy: some random specs in both number types, compiled together, and what their C does."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from engine.interpreter.block_compiler import BlockCompiler
from language.ir.number_type import NUMBER_TYPES
from language.ir.program import Program
from lockstep.comparison import Verdict, compare_output
from lockstep.tick_log import TickLog
from tests.lockstep.random_specs.combined_executable import QUICK, Batch
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.mutant import Mutant
from tests.lockstep.random_specs.spec import Spec, program
from tests.lockstep.random_specs.spec_kinds import spec_of

AT_ONCE = 2
"""Specs that a mutant of the generator compiles together before it looks for a difference."""


@dataclass(frozen=True)
class ReferenceRun:
    """A spec with its Program, the tape of the interpreter and the records of its C."""

    spec: Spec
    program: Program
    tape: TickLog
    output: bytes

    @property
    def verdict(self) -> Verdict:
        """What the comparison gives."""
        return compare_output(self.tape, self.output)


def run_reference_specs(count: int, ticks: int, folder: Path) -> list[ReferenceRun]:
    """Return the first random specs, run by both sides."""
    pairs = [(s, program(s, n, folder)) for s in map(spec_of, range(count)) for n in NUMBER_TYPES]
    batch = Batch([made for _, made in pairs], folder / "batch")
    found = []
    for spec, made in pairs:
        tape = record_ticks(spec, made, ticks)
        found.append(ReferenceRun(spec, made, tape, batch.run(made, b"".join(tape.inputs))))
    return found


def find_killing_spec(
    mutant: Mutant, specs: list[ReferenceRun], ticks: int, patch: pytest.MonkeyPatch, folder: Path
) -> str:
    """Return the first spec in which the mutant differs from the healthy side, '' if none does."""
    if mutant.side == "interpreter":
        return next((one.program.name for one in specs if _differs(mutant, one, ticks, patch)), "")
    for start in range(0, len(specs), AT_ONCE * len(NUMBER_TYPES)):
        some = specs[start : start + AT_ONCE * len(NUMBER_TYPES)]
        with patch.context() as patched:
            mutant.patch(patched)
            batch = Batch([one.program for one in some], folder / str(start), QUICK)
        for one in some:
            if not batch.verdict(one.tape).is_equal:
                return one.program.name
    return ""


def _differs(mutant: Mutant, one: ReferenceRun, ticks: int, patch: pytest.MonkeyPatch) -> bool:
    with patch.context() as patched:
        mutant.patch(patched)
        patched.setattr(
            "engine.interpreter.interpreter._compile_program",
            BlockCompiler,
        )
        tape = record_ticks(one.spec, one.program, ticks, mutant.rewrite(one.program))
    # A run that is stopped earlier differs as well.
    return len(tape.values) != len(one.tape.values) or not compare_output(tape, one.output).is_equal
