"""Healthy: some random specs in both number types, compiled together, and what their C does."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from engine.closures import Compiler
from language.number import NUMBERS
from language.program import Program
from lockstep.compare import Tape, Verdict, judged
from tests.lockstep.chance.batch import QUICK, Batch
from tests.lockstep.chance.kinds import chance
from tests.lockstep.chance.mutant import Mutant
from tests.lockstep.chance.running import taped
from tests.lockstep.chance.spec import Spec, program

AT_ONCE = 2
"""Specs that a mutant of the generator compiles together before it looks for a difference."""


@dataclass(frozen=True)
class Healthy:
    """A spec with its Program, the tape of the interpreter and the records of its C."""

    spec: Spec
    program: Program
    tape: Tape
    output: bytes

    @property
    def verdict(self) -> Verdict:
        """What the comparison gives."""
        return judged(self.tape, self.output)


def healthy(count: int, ticks: int, folder: Path) -> list[Healthy]:
    """Return the first random specs, run by both sides."""
    pairs = [(s, program(s, n, folder)) for s in map(chance, range(count)) for n in NUMBERS]
    batch = Batch([made for _, made in pairs], folder / "batch")
    found = []
    for spec, made in pairs:
        tape = taped(spec, made, ticks)
        found.append(Healthy(spec, made, tape, batch.run(made, b"".join(tape.inputs))))
    return found


def killed_by(
    mutant: Mutant, specs: list[Healthy], ticks: int, patch: pytest.MonkeyPatch, folder: Path
) -> str:
    """Return the first spec in which the mutant differs from the healthy side, '' if none does."""
    if mutant.side == "interpreter":
        return next((one.program.name for one in specs if _differs(mutant, one, ticks, patch)), "")
    for start in range(0, len(specs), AT_ONCE * len(NUMBERS)):
        some = specs[start : start + AT_ONCE * len(NUMBERS)]
        with patch.context() as patched:
            mutant.patch(patched)
            batch = Batch([one.program for one in some], folder / str(start), QUICK)
        for one in some:
            if not batch.verdict(one.tape).is_equal:
                return one.program.name
    return ""


def _differs(mutant: Mutant, one: Healthy, ticks: int, patch: pytest.MonkeyPatch) -> bool:
    with patch.context() as patched:
        mutant.patch(patched)
        patched.setattr("engine.interpreter._closures_of", lambda same: Compiler(same.program))
        tape = taped(one.spec, one.program, ticks, mutant.rewrite(one.program))
    # A run that is stopped earlier differs as well.
    return len(tape.values) != len(one.tape.values) or not judged(tape, one.output).is_equal
