"""Verify the static checks: the time for a large chart, alarms on shipped specs, kinds found.

Times are those of the processor, the best of several: a busy machine changes little.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT))

import modewright as mw  # noqa: E402
from modewright.checking import spec_files  # noqa: E402
from tests.large.charts import large_chart  # noqa: E402

REPEATS = 3
SECONDS = 3.0
"""For the whole command, 30 modes and 180 transitions."""
CASES = ROOT / "tests" / "refused"


def main() -> int:
    """Print every figure; return 0 if all are met."""
    seconds, told = checked_chart()
    alarms = [problem for path in spec_files(ROOT) for problem in mw.check(str(path))]
    found = {p.code for path in CASES.glob("*.yaml") for p in mw.check(str(path))}
    logic = sorted(code for code in found if code.startswith("MW2"))
    figures: dict[str, tuple[object, bool]] = {
        "check of 30 modes, 180 transitions, the command as a whole [s]": (
            round(seconds, 2),
            seconds < SECONDS,
        ),
        "problems of that chart": (told, told == 0),
        "alarms on shipped specs": (len(alarms), not alarms),
        "kinds of problems of modes and transitions, each with a refused case": (
            logic,
            len(logic) >= 15,
        ),
    }
    for name, (value, met) in figures.items():
        print(f"{'met ' if met else 'OPEN'} {name}: {json.dumps(value)}")
    return 0 if all(met for _, met in figures.values()) else 1


def checked_chart() -> tuple[float, int]:
    """Return the least time of several checks of a large chart [s], and how much they tell."""
    command = [str(Path(sys.executable).parent / "modewright"), "check", "chart.yaml", "--json"]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "chart.yaml").write_text(large_chart())
        times, told = [], 0
        for _ in range(REPEATS):
            before = processor_time()
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
            times.append(processor_time() - before)
            told = len(json.loads(done.stdout)["problems"])
    return min(times), told


def processor_time() -> float:
    """Return the processor time of all child processes so far [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    sys.exit(main())
