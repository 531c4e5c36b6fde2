"""Verify "A study killed at 20 random instants and resumed equals the undisturbed one"."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.verify.store import ROOT, Figure, measured

KILLS = 20
STUDIES = ROOT / "tests" / "data" / "studies"
STUDY = "killed"
WORKERS = 2
SEED = 20


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    return measured(4, {"study_killed_at_random_instants": killed_at_random_instants})


def killed_at_random_instants() -> Figure:
    """Kill the command line and, on its own, its workers, 20 times; compare the stores' bytes."""
    random = np.random.default_rng(SEED)
    with tempfile.TemporaryDirectory() as folder:
        undisturbed, killed = Path(folder) / "undisturbed", Path(folder) / "killed"
        start = time.monotonic()
        _sweep(undisturbed).wait()
        seconds = time.monotonic() - start
        finished = [0]
        kills = 0
        while kills < KILLS:
            process = _sweep(killed)
            time.sleep(float(random.uniform(0.3, max(0.6, seconds / 3.0))))
            if process.poll() is None:
                process.kill()
                kills += 1
            process.wait()
            finished.append(len(_blocks(killed)))
            if finished[-1] == len(_blocks(undisturbed)):
                break  # it is done: the rest of the kills fall on a study that has nothing to do
        last = _sweep(killed)
        code = last.wait()
        same = _digest(killed) == _digest(undisturbed)
        left = [path.name for path in killed.rglob("*.part")]
        rises = finished == sorted(finished)
    fine = code == 0 and same and not left and rises and kills == KILLS
    return {
        "met": fine, "kills": kills, "blocks_after_each": finished[1:], "same_bytes": same,
        "left_over": left, "workers": WORKERS,
    }  # fmt: skip


def _sweep(folder: Path) -> subprocess.Popen[bytes]:
    command = [str(Path(sys.executable).parent / "modewright"), "sweep", STUDY]
    command += ["--out", str(folder), "--workers", str(WORKERS), "--block", "1"]
    nowhere = subprocess.DEVNULL
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    return subprocess.Popen(command, cwd=STUDIES, stdout=nowhere, stderr=nowhere, env=environment)


def _blocks(folder: Path) -> list[Path]:
    return sorted((folder / "blocks").glob("[0-9]*.parquet"))


def _digest(folder: Path) -> str:
    total = hashlib.sha256()
    for path in _blocks(folder):
        total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


if __name__ == "__main__":
    raise SystemExit(main())
