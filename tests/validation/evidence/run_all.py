"""Every: all scripts that measure figures, one after the other; a bar that is missed stops none.

A figure that was measured with the same code is not measured again.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.validation.evidence.evidence_store import ROOT

WHOLE = (
    *(
        "reference_traces",
        "language_and_engine",
        "lockstep_bit_equality",
        "random_specs",
        "random_charts",
    ),
    *(
        "command_line",
        "editor",
        "static_checks",
        "chart_speed",
        "studies",
        "performance",
        "diagnosis_evidence/generated_cases",
    ),
    *(
        "diagnosis_variants",
        "tip_out",
        "diagnosis_evidence/interrupted_diagnosis",
        "target_bit_equality",
        "diagnosis_evidence/real_machines",
        "proofs",
        "fuzzing",
    ),
    *("hand_written_c", "mcdc", "paper", "cluster"),
)
PART = (
    "reference_traces",
    "language_and_engine --part",
    "lockstep_bit_equality --ticks 50000",
    "random_specs --specs 20",
    "random_charts --charts 20",
    *("command_line", "editor", "static_checks"),
)
"""What CI measures, with words of its own."""
OF_RECORDINGS = ("reference_traces", "diagnosis_evidence/real_machines")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; print which scripts missed a bar, return 0 if none did."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--part", action="store_true", help="a fixed part, as CI does")
    parser.add_argument("--recordings", metavar="DIR", help="recordings of real machines")
    given = parser.parse_args(arguments)
    missed = []
    for number, script in enumerate(chosen := PART if given.part else WHOLE, start=1):
        print(f"-- {number} of {len(chosen)}: {script}", flush=True)
        name, *words = script.split()
        if given.recordings and name in OF_RECORDINGS:
            words += ["--recordings", given.recordings]
        command = [sys.executable, str(_path_of(name)), *words]
        if subprocess.run(command, check=False).returncode:
            missed.append(name)
    print(f"bars missed or not measured: {', '.join(missed) or 'none'}")
    return 1 if missed else 0


def _path_of(name: str) -> Path:
    """Return the file of a script: one of this folder, or of a folder beside it."""
    folder, _, script = name.rpartition("/")
    return ROOT / "tests" / "validation" / (folder or "evidence") / f"{script}.py"


if __name__ == "__main__":
    sys.exit(main())
