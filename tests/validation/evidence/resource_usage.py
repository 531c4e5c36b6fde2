"""Processor and memory: what processes take. What else runs on a machine only adds to that."""

from __future__ import annotations

import ctypes
import os
import re
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
ATTEMPTS = 3
ADOPT = 36
"""PR_SET_CHILD_SUBREAPER: whose parent has ended becomes a child of this process."""
PATIENCE = 10.0
"""Time [s] that processes have to end after the one that started them."""


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


def with_descendants(run: Callable[[], T]) -> tuple[T, float]:
    """Return what a run gives and the processor time [s] of all processes that it led to.

    Raises TimeoutError where some do not end: they would not be counted.
    """
    ctypes.CDLL(None).prctl(ADOPT, 1, 0, 0, 0)
    before = _so_far()
    found = run()
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            if not os.waitpid(-1, os.WNOHANG)[0]:
                time.sleep(0.05)
        except ChildProcessError:  # all have ended and are counted
            return found, _so_far() - before
    raise TimeoutError(f"processes go on {PATIENCE:g} s after the one that started them")


def peak_megabytes() -> float:
    """Return the most memory [MB] that this program had; getrusage counts who started it, too."""
    status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    peak = re.search(r"^VmHWM:\s+(\d+) kB", status, re.MULTILINE)
    assert peak, "no VmHWM in /proc/self/status"
    return int(peak[1]) / 1024.0


def _so_far() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
