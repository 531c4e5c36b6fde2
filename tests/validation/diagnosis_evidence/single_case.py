"""Open case: one case of the open generator diagnosed in a process of its own; its CPU time too.

python -m tests.validation.diagnosis_evidence.single_case CASE RESULT
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path

import modewright

SPEC = "blind_driveline"
WHO = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


def main() -> None:
    """Diagnose a folder with train/ and held_out/, and write verdict and seconds."""
    case, result = Path(sys.argv[1]), Path(sys.argv[2])
    begun = time.monotonic()
    train, held_out = (sorted((case / part).glob("*.csv")) for part in ("train", "held_out"))
    found = modewright.diagnose(SPEC, train, held_out, thresholds="usual")
    spent = sum(use.ru_utime + use.ru_stime for use in map(resource.getrusage, WHO))
    seconds = {"cpu_s": spent, "wall_s": time.monotonic() - begun}
    temporary = result.with_suffix(".tmp")
    temporary.write_text(json.dumps({"verdict": found.verdict.to_json(), **seconds}))
    temporary.replace(result)


if __name__ == "__main__":
    main()
