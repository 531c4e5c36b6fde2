"""Verify the reproduction of the paper and the better observer; into docs/evidence/paper.json."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from functools import partial
from typing import Any

from language.ir.operation_count import max_operations
from modewright.api.code_generation import instructions as counted_of, metrics
from modewright.api.simulation import program
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures
from tests.validation.paper.claims import PUBLISHED
from tests.validation.paper.observers import NOTES
from tests.validation.paper.report_page import JSON

BARS = {"100": (0.80, 1.6, 100.0), "1000": (0.75, 1.35, 30.0), "10000": (0.28, 0.6, 30.0)}
"""Of the better observer by rate [Hz]: median and 95th percentile of the first delay [ms], false
losses in a minute at 2 N*m."""
FALSE = 2
TORQUE = {True: 2.2, False: 8.0}
"""Root mean square error at 1 kHz [N*m], with the right model and with a wrong one."""
TYPICAL, MOST = 8400, 42000
"""Instructions of a tick on a Cortex-M4F: the usual one, and the longest."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    os.chdir(ROOT)
    return measure_figures(
        "paper",
        {
            "paper": reproduced,
            "the paper's scheme": scheme,
            **{f"better observer, {rate} Hz": partial(better, rate) for rate in BARS},
            "torque at 1 kHz": torque,
            "instructions on the M4F": instructions,
        },
    )


def reproduced() -> Figure:
    """All of it, from specs, by the command."""
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "tests.validation.paper"], cwd=ROOT, check=False)
    late = _found()["table_1_ms"]
    near = all(abs(late[rate] - published) < 0.1 for rate, published in PUBLISHED.items())
    seconds = round(time.perf_counter() - begin)
    return {"met": done.returncode == 0 and near, "table_1_ms": late, "seconds": seconds}


def scheme() -> Figure:
    """Medians of the paper's scheme over random manoeuvres beside those of an independent one."""
    off = {
        row["period"]: row["median"] / NOTES[row["period"]] - 1.0
        for row in _found()["rows"]
        if row["scheme"] == "paper" and row["is_matched"]
    }
    return {"met": all(abs(one) <= 0.15 for one in off.values()), "medians_off": off}


def better(rate: str) -> Figure:
    """Delays, misses and false losses of one setting."""
    found = _found()["better_observer"][rate]
    median, late, cruise = BARS[rate]
    met = (
        found["absolute_median_ms"] <= median
        and found["absolute_p95_ms"] <= late
        and found["missed_first"] == 0
        and found["false"] <= FALSE
        and found["cruise_false_per_min"] <= cruise
    )
    return {"met": met, **found}


def torque() -> Figure:
    """Errors of the torque at 1 kHz."""
    everything = _found()
    names = {True: "better_observer", False: "better_observer_mismatch"}
    off = {right: everything[name]["1000"]["torque_rms_Nm"] for right, name in names.items()}
    met = all(off[right] <= TORQUE[right] for right in off)
    return {"met": met, "matched_Nm": off[True], "mismatch_Nm": off[False]}


def instructions() -> Figure:
    """Instructions of the better observer in float32: through a manoeuvre, and at most."""
    counted = counted_of("hko", "ev_driveline_can", "random_manoeuvre", numbers="float32")
    largest = max(counted.steps)
    bound = metrics("hko", numbers="float32").longest
    operations = max_operations(program("hko").blocks, "step")
    met = counted.mean <= TYPICAL and bound is not None and largest <= bound <= MOST
    return {
        "met": met,
        "mean": counted.mean,
        "largest": largest,
        "bound": bound,
        "bound_in_operations": operations,
    }


def _found() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(JSON.read_text())
    return found


if __name__ == "__main__":
    sys.exit(main())
