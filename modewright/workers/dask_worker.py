"""Cluster worker: what a worker of a Dask cluster finds here by name, and does with a block.

To load this module is to load our packages, whatever folders of their names are around.
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
    """Return the answer of this worker about the variants from `start` to before `stop`."""
    from modewright.runtime.compiled_run import run_block
    from sweep.execution.dask_worker import answer_block
    from sweep.store.row import Block

    return answer_block(expected_fingerprint, serialised_study, Block(start, stop), run_block)


def own_fingerprint() -> Mapping[str, str]:
    """Return the fingerprint of this worker."""
    from sweep.execution.fingerprint import fingerprint

    return fingerprint()


def dask_setup(worker: object) -> None:
    """Leave Ctrl-C to who started this worker: it ends us. Called by Dask."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
