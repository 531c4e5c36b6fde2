"""Verify diagnoses of real machines, LEAF and EMPS; writes docs/evidence/diagnosis.json.

Measured where the real recordings are; resumable.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.diagnosis.real_machines import diagnose_emps, diagnose_leaf
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

EXACT, OFFSET, FORCE = 0.03, 0.06, 0.06
"""Bars of EMPS: M, Fv, Fc and the offset against what is published, and NRMSE of the force."""
FALL, GAP, STIFFNESS = 0.4, 1.35, 1.2
"""Bars of LEAF: how much a gap helps on the other drive, and how well both drives agree."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", default=os.environ.get("MODEWRIGHT_RECORDINGS"))
    named = parser.parse_args().recordings
    if not named:
        print("no recordings: give --recordings DIR or MODEWRIGHT_RECORDINGS")
        return 0
    os.chdir(ROOT)
    folder = Path(named).resolve()
    found: dict[str, Callable[[], Figure]] = {
        "emps_friction_and_offset": partial(servo_axis, folder),
        "leaf_gap": partial(gap, folder),
    }
    return measure_figures("diagnosis", found)


def servo_axis(recordings: Path) -> Figure:
    """Friction and offset named, with the values that are published."""
    figure = diagnose_emps(recordings)
    off = figure["off"]
    is_exact = all(off.get(name, 1.0) <= EXACT for name in ("M", "F_v", "T_c"))
    is_exact = is_exact and off.get("offset", 1.0) <= OFFSET
    named = figure["effects"] == ["coulomb_friction", "sensor_offset"]
    return {"met": named and is_exact and figure["held_out_nrmse"][1] <= FORCE, **figure}


def gap(recordings: Path) -> Figure:
    """The gap named first from either drive, alike, and of use on the other."""
    drives = [
        diagnose_leaf(recordings, "drive_eco", "drive_2"),
        diagnose_leaf(recordings, "drive_2", "drive_eco"),
    ]
    gaps = [drive["half_gap"] or 0.0 for drive in drives]
    stiffness = [drive["k_hs"] for drive in drives]
    met = {
        "named_first": all(d["first"] == "backlash@elements.half_shaft" for d in drives),
        "gap_agrees": max(gaps) <= GAP * min(gaps),
        "stiffness_agrees": max(stiffness) <= STIFFNESS * min(stiffness),
        "falls": all(drive["falls_by"] >= FALL for drive in drives),
    }
    return {"met": all(met.values()), "bars": met, "drives": drives}


if __name__ == "__main__":
    sys.exit(main())
