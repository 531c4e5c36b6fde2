"""Verify language and engine; writes docs/evidence/language_and_engine.json."""

from __future__ import annotations

import argparse
import csv
import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import modewright as mw
from tests.benchmark.large_specs.spec_generators import modes_of_equations
from tests.engine.simulation.test_tip_out import (
    ALWAYS,
    DISCONTINUOUS,
    MANOEUVRES,
    PAPER,
    scenario,
    truth,
)
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures
from tests.validation.evidence.reference_traces import check_refused_specs
from tests.validation.evidence.resource_usage import seconds_of

CORES = ("Haswell", "SandyBridge", "Prescott")
"""Kernels of OpenBLAS that give three patterns of bits."""
CHECK_SECONDS = 2.0
LARGE_GROWTH = 1.3
LARGE_BYTES = 1_000_000_000
SUITES = {
    "matrices": "tests/language/observers/test_steady_kalman.py",
    "drivelines": "tests/engine/simulation/test_drivelines.py",
    "rules_in_lockstep": "tests/semantics/rules",
    "flags_and_compilers": "tests/lockstep/test_compiler_flags.py",
    "mutants": "tests/lockstep/test_mutants.py",
    "book_of_problems": "tests/semantics/invalid_specs",
    "hostile_texts": "tests/modewright/render/test_text_outputs.py",
    "wheel": "tests/packaging/test_wheel.py",
    "notebook": "tests/docs/test_notebook.py",
}
"""Figures that are tests: none may fail or be left out."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", action="store_true", help="without the figures that are tests")
    is_part: bool = parser.parse_args().part
    os.chdir(ROOT)
    found: dict[str, Callable[[], Figure]] = {}
    for name in MANOEUVRES:
        found[f"manoeuvre_{name}"] = partial(manoeuvre, name)
    found["table_1"] = table_1
    found["generate_on_three_kernels"] = generate_anywhere
    found["lockstep_of_types"] = lockstep_of_types
    found["refused"] = check_refused_specs
    found["check_cold"] = check_cold
    found["check_of_3_mb"] = check_of_3_mb
    for name, path in ({} if is_part else SUITES).items():
        found[name] = partial(suite, path)
    return measure_figures("language_and_engine", found)


def manoeuvre(name: str) -> Figure:
    """Events and signals of the plant against a reference trace of others."""
    with tempfile.TemporaryDirectory() as folder:
        system = scenario(name, Path(folder))
        trajectory = mw.simulate(system, "manoeuvre", root=Path(folder))
    with (PAPER / f"truth_{name}_events.csv").open() as file:
        expected = np.array([float(row["t"]) for row in csv.DictReader(file)])
    times = np.array([event.time for event in trajectory.events_of("plant")])
    near = np.any(np.abs(trajectory.times[:, None] - times[None, :]) < 2e-6, axis=1)
    rows, relative = truth(name), {}
    for signal in (*ALWAYS, *DISCONTINUOUS):
        reference = np.array([float(row[signal]) for row in rows])
        kept = ~near if signal in DISCONTINUOUS else np.ones(len(rows), dtype=bool)
        off = np.abs(trajectory.signals[f"plant.{signal}"] - reference)[kept]
        relative[signal] = float(off.max() / (np.abs(reference).max() or 1.0))
    same = len(times) == len(expected)
    late = float(np.abs(times - expected).max(initial=0.0)) if same else None
    met = late is not None and late <= 1e-6 and max(relative.values()) <= 1e-6
    return {"met": met, "events": len(times), "largest_error_s": late, "of_largest": relative}


def table_1() -> Figure:
    """Delays until the loss of contact is seen, Table 1: 14, 2 and 0.8 ms."""
    run = mw.simulate("table_1", "nominal", root=ROOT / "tests" / "data" / "specs" / "table_1")
    lost = run.events_of("plant")[0].time
    published = {"at_100Hz": 14e-3, "at_1kHz": 2e-3, "at_10kHz": 0.8e-3}
    delays = {rate: run.events_of(rate)[0].time - lost for rate in published}
    met = all(abs(delays[rate] - published[rate]) <= 1e-4 for rate in published)
    return {"met": met, "delays_s": delays, "published_s": published}


def check_cold() -> Figure:
    """`modewright check` of every shipped spec, each in a process of its own.

    The bar is on processor time: a busy machine changes little.
    """
    seconds = {}
    for path in sorted((ROOT / "spec").rglob("*.yaml")):
        command = [sys.executable, "-m", "modewright", "check", str(path)]
        run = partial(subprocess.run, command, cwd=ROOT, check=True, capture_output=True)
        seconds[str(path.relative_to(ROOT))] = round(seconds_of(run, CHECK_SECONDS), 2)
    slowest = max(seconds, key=lambda name: seconds[name])
    met = seconds[slowest] < CHECK_SECONDS
    return {"met": met, "specs": len(seconds), "slowest": slowest, "seconds": seconds[slowest]}


def check_of_3_mb() -> Figure:
    """`modewright check` of a valid spec of 3 MB: 190 modes with 190 equations each.

    The bars are on memory, and on processor time for a byte against a spec of a quarter: that it
    grows with the size says more than seconds, which are those of a machine.
    """
    size, seconds, memory = checked(190)
    small_size, small_seconds, _ = checked(95)
    growth = (seconds / size) / (small_seconds / small_size)
    met = growth < LARGE_GROWTH and memory < LARGE_BYTES
    return {
        "met": met,
        "bytes": size,
        "check_s": round(seconds, 1),
        "time_per_byte_to_that_of_a_quarter": round(growth, 2),
        "memory_bytes": memory,
    }


def checked(count: int) -> tuple[int, float, int]:
    """Return size [B], processor time [s] and memory [B] of a check of `count` modes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.yaml"
        path.write_text(modes_of_equations(count, count))
        command = [sys.executable, "-m", "modewright", "check", str(path), "--json"]
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL) as child:
            _, status, used = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
        assert status == 0, "a valid spec is refused"
        return path.stat().st_size, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024


def generate_anywhere() -> Figure:
    """Generated code under three kernels of OpenBLAS, with one and two threads."""
    digests = {}
    for core in CORES:
        for threads in ("1", "2"):
            environ = {**os.environ, "OPENBLAS_CORETYPE": core, "OPENBLAS_NUM_THREADS": threads}
            with tempfile.TemporaryDirectory() as folder:
                for name in ("estimator", "estimator_float32", "estimator_simple", "driveline"):
                    command = [sys.executable, "-m", "modewright", "generate", name]
                    subprocess.run(
                        [*command, "--out", folder], check=True, capture_output=True, env=environ
                    )
                total = hashlib.sha256()
                for path in sorted(Path(folder).rglob("*.[ch]")):
                    total.update(path.name.encode() + b"\0" + path.read_bytes())
            digests[f"{core} {threads}"] = total.hexdigest()
    return {"met": len(set(digests.values())) == 1, "digests": digests}


def lockstep_of_types() -> Figure:
    """Differing bits of the shipped system in both types, at three levels of optimisation."""
    found = {}
    for numbers in ("float64", "float32"):
        for level in ("O0", "O2", "O3"):
            _, verdicts = mw.lockstep("ev_driveline", "tip_out", numbers=numbers, optimise=level)
            for verdict in verdicts:
                found[f"{verdict.name} {numbers} -{level}"] = [verdict.values, verdict.differing]
    met = all(values > 0 and not differing for values, differing in found.values())
    return {"met": met, "values_differing": found}


def suite(path: str) -> Figure:
    """Run a part of the tests; nothing may fail."""
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "no:cacheprovider", path]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return {
        "met": done.returncode == 0,
        "command": f"pytest {path}",
        "said": last_line(done.stdout),
    }


def last_line(text: str) -> str:
    """Return the last line of an output, without the time that it took."""
    lines = text.strip().splitlines() or [""]
    return lines[-1].partition(" in ")[0]


if __name__ == "__main__":
    sys.exit(main())
