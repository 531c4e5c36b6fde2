"""Demo cases: write the simulated recordings that the wheel contains for `modewright demo`.

    python -m tests.generators.open_cases.demo_cases [FOLDER]

Two machines have an effect that their model lacks. `truth.json` beside the recordings names it. The
third set is the simulated drive of `tests/data/synthetic_nissan_leaf`, which that folder's script
writes. The same code writes the same bytes.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from tests.generators.open_cases.case import Case, draw_case, simulate_cases, stream
from tests.generators.open_cases.label import case_label
from tests.generators.open_cases.recording import HEADER, LINE, sample_recording
from tests.generators.open_cases.tip_out import VARIANT, tip_out_case

ROOT = Path(__file__).resolve().parents[3]
TARGET = ROOT / "modewright" / "api" / "demo_data_files"
SEED, RATE = 3, 100
"""Seed of the friction case, and sampling rate of all recordings [Hz]."""
TRAIN = ("shunting", "recuperation", "tips")
HELD_OUT = "departure"
"""The manoeuvres of the friction case; the others are left out to keep the wheel small."""


def friction_case() -> Case:
    """Return a driveline with dry friction at the motor: three training recordings, one other."""
    case = draw_case(SEED, 0, ["coulomb_friction"], 1.0, RATE)
    train = [one for one in case.manoeuvres[: case.train] if one.kind in TRAIN]
    held_out = [one for one in case.manoeuvres[case.train :] if one.kind == HELD_OUT]
    return replace(case, manoeuvres=(*train, *held_out), train=len(train))


def case_files(case: Case) -> dict[str, str]:
    """Return the recordings of a case and its `truth.json`, by file name."""
    generator = stream(case.seed, case.number, "noise")
    (recordings,) = simulate_cases([case])
    files = {}
    for number, recording in enumerate(recordings):
        name = f"train_{number + 1}.csv" if number < case.train else "held_out.csv"
        table = sample_recording(recording, case, generator)
        files[name] = "\n".join([HEADER, *(LINE % tuple(row) for row in table.tolist()), ""])
    label = case_label(case, 1.0)
    kept = {key: label[key] for key in ("effects", "base", "rate_Hz", "noise_and_quantum")}
    files["truth.json"] = json.dumps(kept, indent=1) + "\n"
    return files


def demo_files() -> Mapping[str, str]:
    """Return the files of both machines by path below the folder of the data."""
    files = {"spec/paper_driveline.yaml": VARIANT}
    for name, case in (("friction", friction_case()), ("hysteresis", tip_out_case(rate=RATE))):
        files |= {f"recordings/{name}/{file}": text for file, text in case_files(case).items()}
    return files


def main() -> None:
    """Write the files below the folder of the first argument, else below TARGET."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET
    for name, text in demo_files().items():
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode("ascii"))


if __name__ == "__main__":
    main()
