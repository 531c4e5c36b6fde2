"""Verify the static checks: the time for a large chart, alarms on shipped specs, kinds found.

Times are those of the processor: a busy machine changes little.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

import modewright as mw  # noqa: E402
from modewright.api.spec_check import spec_files  # noqa: E402
from tests.benchmark.large_specs.charts import large_chart  # noqa: E402
from tests.validation.evidence.evidence_store import Figure, measure_figures  # noqa: E402
from tests.validation.evidence.resource_usage import seconds_of  # noqa: E402

SECONDS = 3.0
"""For the whole command, 30 modes and 180 transitions."""
KINDS = 15
"""Least number of kinds of problems of modes and transitions."""
CASES = ROOT / "tests" / "semantics" / "invalid_specs"


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    figures = {"check_of_180_transitions": large, "alarms": alarms, "kinds_of_logic": kinds}
    return measure_figures("mode_logic", figures)


def large() -> Figure:
    """The command as a whole on a chart of 30 modes."""
    seconds, told = checked_chart()
    return {"met": seconds < SECONDS and not told, "seconds": round(seconds, 2), "problems": told}


def alarms() -> Figure:
    """Problems of the shipped specs."""
    told = [str(problem) for path in spec_files(ROOT) for problem in mw.check(str(path))]
    return {"met": not told, "problems": told}


def kinds() -> Figure:
    """Kinds of problems of modes and transitions that refused cases have."""
    found = {p.code for path in CASES.glob("*.yaml") for p in mw.check(str(path))}
    logic = sorted(code for code in found if code.startswith("MW2"))
    return {"met": len(logic) >= KINDS, "codes": logic}


def checked_chart() -> tuple[float, int]:
    """Return the least time of several checks of a large chart [s], and how much they tell."""
    command = [str(Path(sys.executable).parent / "modewright"), "check", "chart.yaml", "--json"]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "chart.yaml").write_text(large_chart())
        run = partial(subprocess.run, command, cwd=folder, capture_output=True, check=False)
        return seconds_of(run, SECONDS), len(json.loads(run().stdout)["problems"])


if __name__ == "__main__":
    sys.exit(main())
