"""Quality: what random specs exercise, and what is asked of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from lockstep.tick_log import TickLog
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.instrumented_program import instrument_program
from tests.lockstep.random_specs.operation_coverage import KINDS, count_executed
from tests.lockstep.random_specs.rule_coverage import BROKEN, INPUTS, LAST, RULES, Hits
from tests.lockstep.random_specs.spec import Spec

COUNTED_TICKS = 40
"""Of each spec, for the operations: closures that count are slow."""
TRANSITIONS, OF_ALL = 3, 0.8
WITH_WAITS = 0.3
MOVING, WAITING = "at least 3 transitions", "a wait broken, and one elapsed on its last tick"


@dataclass
class Quality:
    """Sums over specs: how many there are, what of them holds, what was hit how often."""

    specs: int = 0
    shares: Counter[str] = field(default_factory=Counter)
    hits: Counter[str] = field(default_factory=Counter)

    def add(self, other: Quality) -> None:
        """Add another's sums."""
        self.specs += other.specs
        self.shares.update(other.shares)
        self.hits.update(other.hits)

    def missing_coverage(self, least: int) -> list[str]:
        """Return what is hit less often than asked, in words."""
        found = [
            f"{name}: {self.hits[name]} < {least}"
            for name in (*RULES, *INPUTS, *KINDS)
            if self.hits[name] < least
        ]
        for name, share in ((MOVING, OF_ALL), (WAITING, WITH_WAITS)):
            if self.shares[name] < share * self.specs:
                found.append(f"{name}: {self.shares[name]} of {self.specs}")
        return found

    def table(self) -> str:
        """Return all counts, one a line."""
        lines = [f"{name:56} {self.shares[name]} of {self.specs}" for name in (MOVING, WAITING)]
        lines += [f"{name:56} {self.hits[name]}" for name in (*RULES, *INPUTS, *KINDS)]
        return "\n".join(lines)


def measure_quality(spec: Spec, program: Program, ticks: int) -> tuple[TickLog, Quality]:
    """Return the tape of a spec, and what it exercised."""
    hits = Hits(spec, program)
    last: list[Interpreter] = []

    def look(stepper: Interpreter) -> None:
        hits.observe(stepper)
        last[:] = [stepper]

    tape = record_ticks(spec, program, ticks, instrument_program(program), look, hits.log)
    hits.finish(last[0])
    counts = hits.rules + hits.inputs + count_executed(spec, program, min(ticks, COUNTED_TICKS))
    shares = Counter({MOVING: int(tape.transitions >= TRANSITIONS)})
    shares[WAITING] = int(hits.rules[BROKEN] > 0 and hits.rules[LAST] > 0)
    return tape, Quality(1, shares, counts)
