"""Verify the paper's own mismatch: a shaft that depends on the amplitude, hidden in tip-outs at
100 Hz, is told, named and repaired; into docs/evidence/diagnosis.json.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import modewright as mw
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.report_text import format_oscillation
from tests.generators.open_cases.case import simulate_cases
from tests.generators.open_cases.recording import write_case
from tests.generators.open_cases.tip_out import SHAFT, VARIANT, tip_out_case
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

LESS = 0.6
"""Most of the held-out misfit of free simulation that is left with the effect."""


def main() -> int:
    """Measure what is not measured yet; return 0 if the bar is met."""
    os.chdir(ROOT)
    return measure_figures("diagnosis", {"paper_tip_out": paper_tip_out})


def paper_tip_out() -> Figure:
    """Diagnose three tip-outs, with a fourth held out, and the same without what is hidden."""
    hidden, clean = diagnosed(hidden=True), diagnosed(hidden=False)
    verdict, found = hidden.verdict, hidden.diagnosis
    assert found
    before, after = found.oscillations
    fit = verdict.fit["held_out"].values()
    left = [one.nrmse_after / one.nrmse_before for one in fit]
    names = [(one.id, one.place) for one in verdict.effects]
    told = format_oscillation(hidden)
    met = (
        names == [(SHAFT.name, "elements.half_shaft")]
        and verdict.confirmed is True
        and "growing as the amplitude falls" in told
        and after.followed_time > before.followed_time
        and max(left) < LESS
        and clean.verdict.verdict == "nothing_missing"
    )
    return {
        "met": met,
        "told": told,
        "effects": [f"{name}@{place}" for name, place in names],
        "fits_until_s": [round(before.followed_time, 2), round(after.followed_time, 2)],
        "held_out_misfit_left": [round(one, 2) for one in left],
        "confirmed": verdict.confirmed,
        "clean": clean.verdict.verdict,
    }


def diagnosed(hidden: bool) -> DiagnosisReport:
    """Return the diagnosis of the tip-outs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        case = tip_out_case(hidden)
        write_case(folder, case, simulate_cases([case])[0])
        spec = folder / "spec"
        spec.mkdir()
        (spec / "paper_driveline.yaml").write_text(VARIANT)
        base = (ROOT / "spec" / "recorded" / "blind_driveline.yaml").read_text()
        (spec / "blind_driveline.yaml").write_text(base)
        columns = (ROOT / "spec" / "recorded" / "map_blind.yaml").read_text()
        (spec / "map_blind.yaml").write_text(columns)
        train = sorted((folder / "train").glob("*.csv"))
        held_out = sorted((folder / "held_out").glob("*.csv"))
        return mw.diagnose("paper_driveline", train, held_out, root=folder)


if __name__ == "__main__":
    sys.exit(main())
