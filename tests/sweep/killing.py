"""Killing: what workers of a cluster do in tests - quick results, and deaths."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping
from pathlib import Path

from engine.batch import Batch, BatchResult
from sweep.block import Block
from sweep.cluster_worker import Answer, answer
from sweep.fingerprint import fingerprint
from tests.sweep.laying import quick


def quickly(wanted: Mapping[str, str], held: bytes, start: int, stop: int) -> Answer:
    return answer(wanted, held, Block(start, stop), quick)


def deadly(mark: Path, wanted: Mapping[str, str], held: bytes, start: int, stop: int) -> Answer:
    """The block from 20 on ends its worker once, that from 40 on always."""
    if start == 40 or (start == 20 and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return quickly(wanted, held, start, stop)


def held_deadly(mark: Path, data: bytes) -> bytes:
    """The first worker that is given the study ends."""
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return data


def always_deadly(data: bytes) -> bytes:
    os.kill(os.getpid(), signal.SIGKILL)
    return data


def broken(wanted: Mapping[str, str], held: bytes, start: int, stop: int) -> Answer:
    def run(batch: Batch) -> BatchResult:
        raise ZeroDivisionError("of our own")

    return answer(wanted, held, Block(start, stop), run)


def own() -> Mapping[str, str]:
    return fingerprint()


def older() -> Mapping[str, str]:
    return {**fingerprint(), "modewright": "0" * 64}
