"""Verify that a diagnosis killed at random instants and run again gives the same verdict.

Into docs/evidence/diagnosis.json.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

SEED = 5
"""Of the case, and of the instants."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=10, help="instants")
    kills: int = parser.parse_args().kills
    os.chdir(ROOT)
    return measure_figures("diagnosis", {"killed_and_resumed": partial(killed_and_resumed, kills)})


def killed_and_resumed(kills: int = 10) -> Figure:
    """Kill runs of one case of the open generator, run them again, compare the verdicts."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _generate(folder)
        _diagnosed(folder, "warm")
        begun = time.monotonic()
        expected = _diagnosed(folder, "whole")
        whole = time.monotonic() - begun
        chance = random.Random(SEED)
        instants = sorted(chance.uniform(0.05, 0.95) * whole for _ in range(kills))
        kept, differing, finished = [], [], 0
        for k, instant in enumerate(instants):
            kept.append(_killed(folder, f"killed_{k}", instant))
            finished += (folder / f"killed_{k}" / "verdict.json").exists()
            if _diagnosed(folder, f"killed_{k}") != expected:
                differing.append(round(instant, 2))
        return {
            "met": not differing and not finished and max(kept) > 0,
            "verdict": expected["verdict"],
            "kills": kills,
            "kept_fits_at_the_kills": kept,
            "finished_before_the_kill": finished,
            "differing": differing,
        }


def _generate(folder: Path) -> None:
    words = ["--out", str(folder / "cases"), "--labels", str(folder / "labels.json")]
    words += ["--seed", str(SEED), "--effects", "stribeck_friction", "--rate", "100"]
    subprocess.run([sys.executable, "-m", "tests.generators.open_cases", *words], check=True)


def _words(folder: Path, out: str) -> list[str]:
    case = folder / "cases" / "case_000"
    words = [sys.executable, "-m", "modewright", "-q", "diagnose", "blind_driveline"]
    for option in ("train", "held_out"):
        for path in sorted((case / option).glob("*.csv")):
            words += ["--" + option.replace("_", "-"), str(path)]
    return [*words, "--out", str(folder / out)]


def _diagnosed(folder: Path, out: str) -> dict[str, Any]:
    """Return the verdict of a run, without the time that it took."""
    subprocess.run(_words(folder, out), check=True, capture_output=True)
    found: dict[str, Any] = json.loads((folder / out / "verdict.json").read_text())
    return {**found, "runtime_s": 0}


def _killed(folder: Path, out: str, instant: float) -> int:
    """Kill a run after some time [s]; return how many fits it has kept."""
    with subprocess.Popen(
        _words(folder, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        try:
            process.wait(instant)
        except subprocess.TimeoutExpired:
            process.kill()
    return len(list((folder / out / "stages").glob("*.npz")))


if __name__ == "__main__":
    sys.exit(main())
