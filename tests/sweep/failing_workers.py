"""Killing: what workers of a cluster do in tests - quick results, and deaths."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping
from pathlib import Path

from engine.batch.batch import Batch, BatchResult
from sweep.execution.dask_worker import Answer, answer_block
from sweep.execution.fingerprint import fingerprint
from sweep.store.row import Block
from tests.sweep.example_studies import quick_results


def answer_quickly(
    expected_fingerprint: Mapping[str, str], serialised_study: bytes, start: int, stop: int
) -> Answer:
    return answer_block(expected_fingerprint, serialised_study, Block(start, stop), quick_results)


def kill_worker_at_block(
    mark: Path,
    expected_fingerprint: Mapping[str, str],
    serialised_study: bytes,
    start: int,
    stop: int,
) -> Answer:
    """The block from 20 on ends its worker once, that from 40 on always."""
    if start == 40 or (start == 20 and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return answer_quickly(expected_fingerprint, serialised_study, start, stop)


def kill_first_holder(mark: Path, data: bytes) -> bytes:
    """The first worker that is given the study ends."""
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return data


def kill_every_holder(data: bytes) -> bytes:
    os.kill(os.getpid(), signal.SIGKILL)
    return data


def answer_with_defect(
    expected_fingerprint: Mapping[str, str], serialised_study: bytes, start: int, stop: int
) -> Answer:
    def run(batch: Batch) -> BatchResult:
        raise ZeroDivisionError("of our own")

    return answer_block(expected_fingerprint, serialised_study, Block(start, stop), run)


def own_fingerprint() -> Mapping[str, str]:
    return fingerprint()


def older_fingerprint() -> Mapping[str, str]:
    return {**fingerprint(), "modewright": "0" * 64}
