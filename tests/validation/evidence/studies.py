"""Verify studies: killed at 20 random instants and resumed; the memory of a million variants."""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures

KILLS = 20
STUDIES = ROOT / "tests" / "data" / "studies"
STUDY = "killed"
WORKERS = 2
SEED = 20
SECONDS = (0.05, 1.0)
"""Between these a process is killed: after its start, or after its first block."""
MOST_MEGABYTES = 500.0
MILLION = 1_000_000
CLIENT = """
import sys, time
from pathlib import Path
import modewright
from sweep.execution.process_executor import ProcessExecutor
from sweep.execution.study_run import run_study
from sweep.analysis.summary import summary_of
from tests.sweep.example_studies import make_study
from tests.validation.evidence.resource_usage import peak_megabytes

axes = "{linspace: [1 rad/s, 3 rad/s, 1000]}", "{linspace: [0 1/s, 1 1/s, 1000]}"
changes = (("[1 rad/s, 3 rad/s]", axes[0]), ("[0.05 1/s, 0.3 1/s]", axes[1]))
made = make_study("alone", *changes, ("one_at_a_time", "grid"))
worker = "import modewright; from tests.sweep.example_studies import quick_results"
worker += "; from sweep.execution.worker import serve_blocks; serve_blocks(quick_results)"
start = time.monotonic()
found = run_study(made, Path(sys.argv[1]), ProcessExecutor(2, [sys.executable, "-c", worker]))
seconds = time.monotonic() - start
lines = summary_of(found.store).lines
assert lines[0].count == made.count == 1_000_000
print(peak_megabytes(), seconds)
"""
"""A study whose variants cost nothing, through real workers: what the client itself takes."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", action="store_true", help="without the million variants")
    figures: dict[str, Callable[[], Figure]] = {
        "study_killed_at_random_instants": killed_at_random_instants
    }
    if not parser.parse_args().part:
        figures["study_of_a_million_variants"] = a_million_variants
    return measure_figures("performance", figures)


def killed_at_random_instants() -> Figure:
    """Kill the command line and, on its own, its workers, 20 times; compare the stores' bytes."""
    random = np.random.default_rng(SEED)
    kills = 0
    with tempfile.TemporaryDirectory() as folder:
        undisturbed, killed = Path(folder) / "undisturbed", Path(folder) / "killed"
        _sweep(undisturbed).wait()
        finished = [0]
        for number in range(KILLS):
            process = _sweep(killed)
            if number % 2:
                _await_block(killed, finished[-1], process)
            time.sleep(float(random.uniform(*SECONDS)))
            kills += process.poll() is None
            process.kill()
            process.wait()
            finished.append(len(_blocks(killed)))
        last = _sweep(killed)
        code = last.wait()
        count = len(_blocks(undisturbed))
        same = bytes_digest(killed) == bytes_digest(undisturbed)
        left = [path.name for path in killed.rglob("*.part")]
        rises = finished == sorted(finished)
    is_inside = 0 < finished[-1] < count and len(set(finished)) > KILLS // 3
    fine = code == 0 and same and not left and rises and is_inside and kills == KILLS
    return {
        "met": fine, "kills": kills, "blocks": count, "blocks_after_each": finished[1:],
        "same_bytes": same, "left_over": left, "workers": WORKERS,
    }  # fmt: skip


def _await_block(folder: Path, before: int, process: subprocess.Popen[bytes]) -> None:
    """Wait until one more block is there."""
    while len(_blocks(folder)) <= before and process.poll() is None:
        time.sleep(0.005)


def a_million_variants() -> Figure:
    """Run and sum up a million variants; the memory is that of the process that was started."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", CLIENT, str(Path(folder) / "out")]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        size = sum(path.stat().st_size for path in _blocks(Path(folder) / "out"))
    megabytes, seconds = (float(word) for word in done.stdout.split())
    return {
        "met": megabytes < MOST_MEGABYTES, "variants": MILLION, "client_megabytes": megabytes,
        "seconds": seconds, "store_megabytes": size / 1e6,
    }  # fmt: skip


def _sweep(folder: Path) -> subprocess.Popen[bytes]:
    command = [str(Path(sys.executable).parent / "modewright"), "sweep", STUDY]
    command += ["--out", str(folder), "--workers", str(WORKERS), "--block", "1"]
    nowhere = subprocess.DEVNULL
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    return subprocess.Popen(command, cwd=STUDIES, stdout=nowhere, stderr=nowhere, env=environment)


def _blocks(folder: Path) -> list[Path]:
    return sorted((folder / "blocks").glob("[0-9]*.parquet"))


def bytes_digest(folder: Path) -> str:
    """Return the digest of all blocks of a store, with their names."""
    total = hashlib.sha256()
    for path in _blocks(folder):
        total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


if __name__ == "__main__":
    raise SystemExit(main())
