"""Machines: what a diagnosis finds on recordings of real ones, for tests and evidence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import modewright as mw

Figure = dict[str, Any]
RPM = 0.10471975511965977
EMPS = {"M": 95.109, "F_v": 203.5, "T_c": 20.39, "offset": -3.165}
"""Published: Janot, Gautier, Brunot 2019."""
TIP_OUTS = {
    "drive_eco": ("@19.2..20.9",),
    "drive_2": ("@6.7..8.0", "@15.4..16.6"),
}
"""Parts of the LEAF's drives around what a gap does there."""


def diagnose_emps(recordings: Path) -> Figure:
    """Friction and offset of the servo axis: trained on the first half, shown on the second."""
    file = recordings / "emps" / "emps.csv.gz"
    verdict = mw.diagnose("emps", [f"{file}@0..12.4"], [f"{file}@12.4..24.9"]).verdict
    found = {name: quantity.value for name, (_, quantity) in verdict.base.items()}
    for effect in verdict.effects:
        found |= {name: one.value for name, one in effect.parameters.items()}
    shown = verdict.fit["held_out"]["F_m"]
    return {
        "effects": [effect.id for effect in verdict.effects],
        "off": {name: abs(found[name] / EMPS[name] - 1.0) for name in EMPS if name in found},
        "values": {name: found[name] for name in EMPS if name in found},
        "held_out_nrmse": [shown.nrmse_before, shown.nrmse_after],
        "confirmed": verdict.confirmed,
    }


def diagnose_leaf(recordings: Path, train: str, other: str) -> Figure:
    """The gap of the LEAF's half-shafts: trained on one drive, shown on the tip-outs of another."""
    folder = recordings / "nissan_leaf"
    held_out = [f"{folder / other}.csv{part}" for part in TIP_OUTS[other]]
    verdict = mw.diagnose("leaf_motor_side", [f"{folder / train}.csv"], held_out).verdict
    shown = verdict.fit["held_out"]["w_em"]
    gaps = [e.parameters["alpha"].value for e in verdict.effects if e.id == "backlash"]
    first = verdict.candidates[0]
    return {
        "first": f"{first.id}@{first.place}",
        "effects": [effect.id for effect in verdict.effects],
        "half_gap": gaps[0] if gaps else None,
        "k_hs": verdict.base["k_hs"][1].value,
        "held_out_rpm": [shown.rmse_before / RPM, shown.rmse_after / RPM],
        "falls_by": 1.0 - shown.rmse_after / shown.rmse_before,
        "confirmed": verdict.confirmed,
    }


def diagnose_damper(recordings: Path, file: str) -> Figure:
    """The gap of the friction damper in eight seconds of one series."""
    train = f"{recordings / 'brfd_damper' / file}@2..10"
    verdict = mw.diagnose("brfd_damper", [train]).verdict
    shown = verdict.fit["train"]["F"]
    gaps = [e.parameters["alpha"].value for e in verdict.effects if e.id == "backlash"]
    return {
        "effects": [effect.id for effect in verdict.effects],
        "half_gap": gaps[0] if gaps else None,
        "nrmse": [shown.nrmse_before, shown.nrmse_after],
    }
