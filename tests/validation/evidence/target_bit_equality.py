"""Verify the target: engine, gcc, clang and an emulated Cortex-M4F over long closed loops.

Writes docs/evidence/c_code.json; a figure of the same code is not measured again.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from fractions import Fraction
from functools import partial

from codegen.toolchain.compiler import flags_at_level
from codegen.toolchain.target_machine import CORTEX_M4F, HOST, Machine
from language.ir.number_type import NUMBER_TYPES, NumberType
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from tests.codegen.target.closed_loop import record_driveline, record_supervisor
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

LEVELS = ("O0", "O2", "O3", "Os")
BUILDS: tuple[tuple[str, Machine, str | None], ...] = (
    ("gcc", HOST, "gcc"),
    ("clang", HOST, "clang-19"),
    (CORTEX_M4F.name, CORTEX_M4F, None),
)
SUBJECT, STEPS = "c_code", 20_000
LOOPS: dict[str, Callable[[NumberType], dict[str, TickLog]]] = {
    "plant": lambda number: record_driveline(number, Fraction(STEPS, 4000), ["plant"]),
    "est": lambda number: record_driveline(number, Fraction(STEPS, 1000), ["est"]),
    "simple": lambda number: record_driveline(number, Fraction(STEPS, 100), ["simple"]),
    "sup": lambda number: record_supervisor(number, Fraction(STEPS, 100)),
}
"""Instances with the loops that run them for so many steps: of 0.25, 1, 10 and 10 ms."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    os.chdir(ROOT)
    figures = {
        f"bits of {name}, {number}": partial(compared, name, number)
        for number in NUMBER_TYPES
        for name in LOOPS
    }
    return measure_figures(SUBJECT, figures)


def compared(name: str, number: NumberType) -> Figure:
    """Return how many bits differ, by compiler and level, over one long run."""
    tape = LOOPS[name](number)[name]
    found = {}
    for build, machine, named in BUILDS:
        for level in LEVELS:
            verdict = compare(tape, flags_at_level(level), named, machine)
            found[f"{build} -{level}"] = verdict.differing
    ticks = len(tape.values)
    return {
        "steps": ticks,
        "transitions": tape.transitions,
        "values": ticks * len(tape.names),
        "differing": found,
        "met": ticks >= STEPS and tape.transitions > 0 and not any(found.values()),
    }


if __name__ == "__main__":
    sys.exit(main())
