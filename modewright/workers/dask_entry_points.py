"""Dask entry points: functions that Dask calls by name in a worker process.

The module imports the packages of this installation, independent of the working folder.
"""

from __future__ import annotations

import signal
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sweep.execution.dask_worker import Answer


def compute_block(
    expected_fingerprint: Mapping[str, str], serialised_study: bytes, start: int, stop: int
) -> Answer:
    """Return the answer of this worker for the variants from `start` to `stop` (exclusive).

    It is the file of the block, or the reason why there is none. A worker refuses if its own
    fingerprint is not `expected_fingerprint` or the Programs of the study differ here.
    """
    from modewright.runtime.back_end_choice import run_block
    from sweep.execution.dask_worker import answer_block
    from sweep.store.row import Block

    return answer_block(expected_fingerprint, serialised_study, Block(start, stop), run_block)


def own_fingerprint() -> Mapping[str, str]:
    """Return the versions and digests of this worker by part; equal ones give equal bits."""
    from sweep.execution.fingerprint import fingerprint

    return fingerprint()


def dask_setup(_worker: object) -> None:
    """Ignore Ctrl-C in the worker; the parent process ends it. Dask calls this at the start."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
