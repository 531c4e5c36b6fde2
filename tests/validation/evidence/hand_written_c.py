"""Verify speed: generated C against twins of the same specs that were written by hand.

Writes docs/evidence/c_code.json; a figure of the same code is not measured again.
"""

from __future__ import annotations

import os
import sys
from fractions import Fraction
from functools import partial

from codegen.toolchain.target_machine import CORTEX_M4F, HOST, Machine
from tests.codegen.hand_written_c.timing_comparison import duel
from tests.codegen.target.closed_loop import record_driveline
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

SUBJECT, MOST = "c_code", 1.1
TWINS = {"est": ("estimator", Fraction(20)), "plant": ("plant", Fraction(5))}
"""Instances of the driveline, their twins, and 20 000 steps of each [s]."""
ROUNDS = {HOST.name: 25, CORTEX_M4F.name: 1}
"""Instructions are counted, time is measured."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    os.chdir(ROOT)
    figures = {
        f"{name} against its twin, {machine.name}": partial(against, name, machine)
        for name in TWINS
        for machine in (HOST, CORTEX_M4F)
    }
    return measure_figures(SUBJECT, figures)


def against(name: str, machine: Machine) -> Figure:
    """Return what a step takes, of the generated code and of its twin, in one run."""
    twin, horizon = TWINS[name]
    found = duel(
        record_driveline("float32", horizon, [name])[name], twin, ROUNDS[machine.name], machine
    )
    generated, by_hand = found.best
    return {
        "steps": found.steps,
        "differing": found.differing,
        "generated": round(generated, 2),
        "by_hand": round(by_hand, 2),
        "unit": "ns" if machine is HOST else "instructions",
        "ratio": round(found.ratio, 3),
        "met": found.differing == 0 and found.ratio <= MOST,
    }


if __name__ == "__main__":
    sys.exit(main())
