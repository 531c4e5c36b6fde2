"""A scheduler that freezes or dies ends a run in a time, with one line, and all is kept."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from sweep.execution import dask_client as clustering
from sweep.execution.dask_address import Address, Credentials
from sweep.execution.dask_client import WorkerSetup, open_client
from sweep.execution.dask_error import ClusterError
from sweep.execution.dask_executor import DaskExecutor
from sweep.execution.study_run import run_study
from tests.sweep.example_studies import make_study
from tests.sweep.failing_workers import answer_quickly, own_fingerprint

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
START = """
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0",
        protocol="tcp://", host="127.0.0.1",
    ) as here:
        print(here.scheduler_address, flush=True)
        sys.stdin.read()
"""


@contextmanager
def scheduler() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Yield a process with a scheduler and a worker, and its address."""
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", START]
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
    assert process.stdout
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.communicate()


@pytest.mark.long
@pytest.mark.parametrize(
    ("sign", "told"),
    [
        (signal.SIGSTOP, r"the scheduler does not answer for 2 s"),
        (signal.SIGKILL, r"the (scheduler (does not answer any more|has dropped)|connection)"),
    ],
)
def test_a_scheduler_that_is_gone_is_told_in_one_line(
    sign: signal.Signals,
    told: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(clustering, "CLOSE_TIMEOUT", 1.0)
    with scheduler() as (process, address):
        made = make_study()
        seen: list[int] = []

        def hit(done: int, before: int, total: int) -> None:
            if done >= 12 and not seen:
                seen.append(done)
                os.kill(process.pid, sign)

        start = time.monotonic()
        with (
            pytest.raises(ClusterError) as raised,
            open_client(
                Address(url=address), Credentials(), WorkerSetup(own_fingerprint), timeout=20.0
            ) as client,
        ):
            run_study(made, tmp_path, DaskExecutor(client, answer_quickly, timeout=2.0), 4, hit)
        assert re.match(told, str(raised.value)), str(raised.value)
        assert time.monotonic() - start < 60.0
        assert len(list(tmp_path.glob("blocks/0*.parquet"))) >= 3
    assert capfd.readouterr().err == ""
