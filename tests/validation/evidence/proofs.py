"""Verify the C of every sampled automaton that is shipped: warnings, MISRA C, stack and values.

Writes docs/evidence/c_code.json; a figure of the same code is not measured again.
"""

from __future__ import annotations

import os
import sys
from functools import partial

from codegen.proofs.all import CHECKS
from modewright.api.code_generation import prove
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

SUBJECT = "c_code"
AUTOMATA = (
    *("estimator", "estimator_float32", "estimator_simple", "estimator_written", "hko"),
    *("supervisor", "contactor"),
)


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    os.chdir(ROOT)
    figures = {
        f"{check} of {name}": partial(proved, name, check) for check in CHECKS for name in AUTOMATA
    }
    return measure_figures(SUBJECT, figures)


def proved(name: str, check: str) -> Figure:
    """Return what a check says of the C of an automaton."""
    found = list(prove(name, checks=(check,)))
    return {
        "tools": [proof.tool for proof in found],
        "of": [proof.about for proof in found],
        "findings": [finding for proof in found for finding in proof.findings],
        "met": all(proof.holds and proof.is_asked for proof in found),
    }


if __name__ == "__main__":
    sys.exit(main())
