"""Processor: how much of it child processes take. What else runs on a machine only adds to that."""

from __future__ import annotations

import resource
from collections.abc import Callable

ATTEMPTS = 3


def seconds_of(run: Callable[[], object], bar: float = 0.0, attempts: int = ATTEMPTS) -> float:
    """Return the least processor time [s] of runs of child processes: one within `bar` will do."""
    least = float("inf")
    for _ in range(attempts):
        before = _so_far()
        run()
        least = min(least, _so_far() - before)
        if least < bar:
            break
    return least


def _so_far() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
