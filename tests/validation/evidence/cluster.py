"""Verify large studies: variants side by side, a cluster with workers killed, a million variants.

Times are those of processes here, which share this machine with whatever else runs on it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from tests.benchmark.performance_ratios import batch_over_c
from tests.validation.evidence.evidence_store import ROOT, Figure, measure_figures
from tests.validation.evidence.resource_usage import with_descendants
from tests.validation.evidence.studies import MILLION, MOST_MEGABYTES, bytes_digest

VARIANTS, WORKERS, KILLS = 100_000, 4, 2
PAIRS, SIDE_BY_SIDE = 15, 1.5
"""Pairs of a ratio, and the least one of variants side by side to the C by hand; 3 is aimed at."""
COMPARED = 3
"""Pairs of runs by local processes and by Dask, one after the other; the median counts."""
MOST_OVERHEAD = 0.15
"""Processor time and time on the clock that Dask may add to that of as many local processes."""
STUDY = """language: 1
study: many_tip_outs
of: ev_driveline_ideal
scenarios: [tip_out]
vary:
  plant.k_hs:  {{uniform: [3600 N*m/rad, 6000 N*m/rad]}}
  plant.alpha: {{uniform: [0.015 rad, 0.035 rad]}}
set:
  initial.plant.theta_d: 0.0484754719736 rad * 4800 N*m/rad / plant.k_hs + plant.alpha
sampling: {{random: {count}, seed: 1}}
measures:
  t_loss: {{time: plant.no_contact}}
  losses: {{count: plant.no_contact}}
  late:   {{delay: est.gap, after: plant.no_contact, before: 15 ms, within: 40 ms}}
"""
CLIENT = """
import json, sys, time
import modewright
from tests.validation.evidence import cluster
from tests.validation.evidence.resource_usage import peak_megabytes

start = time.monotonic()
found = getattr(cluster, sys.argv[1])(*sys.argv[2:])
seconds = time.monotonic() - start
print(json.dumps({**found, "seconds": seconds, "client_megabytes": peak_megabytes()}))
"""
"""One run in a process of its own: what it says, how long it took, its memory."""


def main() -> int:
    """Measure what is not measured yet; return 0 if every bar is met."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=VARIANTS, help="variants of real runs")
    count: int = parser.parse_args().count
    figures: dict[str, Callable[[], Figure]] = {
        "variants_side_by_side": side_by_side,
        "cluster_with_two_workers_killed": partial(two_killed_and_what_dask_costs, count),
        "cluster_of_a_million_variants": a_million_variants,
    }
    return measure_figures("large_studies", figures)


def side_by_side() -> Figure:
    """Variants a second against the C by hand, at its step; events located, bits as of one run."""
    found = batch_over_c(PAIRS)
    return {"met": found["median"] >= SIDE_BY_SIDE, **found}


def two_killed_and_what_dask_costs(count: int) -> Figure:
    """Run a study by local processes and by Dask, in turn, and by Dask with two workers killed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = folder / "many_tip_outs.yaml"
        study.write_text(STUDY.format(count=count))

        def ran(kind: str, number: int = 0) -> dict[str, Any]:
            return _client("sweep_by", kind, str(study), str(folder / f"{kind}_{number}"))

        ran("warm")
        pairs = [
            {kind: ran(kind, number) for kind in ("processes", "dask")}
            for number in range(COMPARED)
        ]
        killed = ran("killed")
        digests = {bytes_digest(out) for out in folder.iterdir() if out.is_dir()}
    more = {
        key: [one["dask"][key] / one["processes"][key] - 1.0 for one in pairs]
        for key in ("seconds", "processor_seconds")
    }
    met = max(map(statistics.median, more.values())) <= MOST_OVERHEAD
    return {
        "met": met and len(digests) == 1 and killed["kills"] == KILLS,
        "variants": count, "workers": WORKERS, "same_bytes": len(digests) == 1,
        "overhead": {key: {"median": statistics.median(all_), "all": all_}
                     for key, all_ in more.items()},
        "pairs": pairs, "killed": killed,
        "load": [round(load, 2) for load in os.getloadavg()],
    }  # fmt: skip


def sweep_by(kind: str, study: str, out: str) -> dict[str, Any]:
    """Run a study by local processes or by Dask; two of its workers are killed where asked for."""
    import modewright as mw
    from modewright.api.studies import TEMPLATE_MODULE
    from modewright.workers import dask_entry_points as cluster_worker
    from sweep.execution import fork_server
    from sweep.execution.dask_address import Address, Credentials
    from sweep.execution.dask_client import WorkerSetup, open_client
    from sweep.execution.dask_executor import DaskExecutor

    if kind == "warm":  # what is compiled is compiled, what is read is read
        mw.sweep(study, out, root=ROOT, samples=2000, workers=WORKERS)
        shutil.rmtree(out)
        return {}
    if kind == "processes":
        return {"variants": mw.sweep(study, out, root=ROOT, workers=WORKERS).computed}
    if kind == "dask":
        found = mw.sweep(study, out, root=ROOT, cluster=f"local:{WORKERS}")
        return {"variants": found.computed}
    staff = WorkerSetup(cluster_worker.own_fingerprint, cluster_worker.__name__)
    fork_server.start_fork_server(TEMPLATE_MODULE)
    killed: list[int] = []
    with open_client(Address(count=WORKERS), Credentials(), staff) as client:

        def kill(done: int, before: int, total: int) -> None:
            """Kill a worker at a third and at two thirds of the way."""
            if len(killed) < KILLS and done > total * (len(killed) + 1) // (KILLS + 1):
                there = client.run(os.getpid).values()
                killed.append(next(pid for pid in there if pid not in killed))
                os.kill(killed[-1], signal.SIGKILL)

        executor = DaskExecutor(client, cluster_worker.compute_block)
        found = mw.sweep(study, out, root=ROOT, executor=executor, progress=kill)
    return {"variants": found.computed, "lost": len(found.lost_blocks), "kills": len(killed)}


def a_million_variants() -> Figure:
    """Run and sum up a million variants that cost nothing: what the client itself takes."""
    with tempfile.TemporaryDirectory() as folder:
        ran = _client("million", str(Path(folder) / "out"))
    met = ran["client_megabytes"] < MOST_MEGABYTES and ran["variants"] == MILLION
    return {"met": met, **ran}


def million(out: str) -> dict[str, Any]:
    """Run a million variants on two workers; the scheduler is in the client's process, too."""
    from sweep.analysis.summary import summary_of
    from sweep.execution.dask_address import Address, Credentials
    from sweep.execution.dask_client import WorkerSetup, open_client
    from sweep.execution.dask_executor import DaskExecutor
    from sweep.execution.study_run import run_study
    from tests.sweep.example_studies import make_study
    from tests.sweep.failing_workers import answer_quickly, own_fingerprint

    axes = "{linspace: [1 rad/s, 3 rad/s, 1000]}", "{linspace: [0 1/s, 1 1/s, 1000]}"
    changes = (("[1 rad/s, 3 rad/s]", axes[0]), ("[0.05 1/s, 0.3 1/s]", axes[1]))
    made = make_study("alone", *changes, ("one_at_a_time", "grid"))
    with open_client(Address(count=2), Credentials(), WorkerSetup(own_fingerprint)) as client:
        found = run_study(made, Path(out), DaskExecutor(client, answer_quickly))
    return {"variants": summary_of(found.store).lines[0].count}


def _client(*arguments: str) -> dict[str, Any]:
    """Return what a run in a process of its own tells, and all processor time that it led to."""
    command = [sys.executable, "-c", CLIENT, *arguments]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done, used = with_descendants(
        lambda: subprocess.run(
            command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, check=True
        )
    )
    return {**json.loads(done.stdout.splitlines()[-1]), "processor_seconds": used}


if __name__ == "__main__":
    raise SystemExit(main())
