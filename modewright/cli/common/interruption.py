"""Interruption: Ctrl-C once, however often it is pressed."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

GRACE_PERIOD = 15.0
"""Time [s] that a work has to end after Ctrl-C; then another one interrupts that too."""


@contextmanager
def debounce_interrupts() -> Iterator[None]:
    """Let the first Ctrl-C interrupt; those that follow do not disturb how the work ends."""
    is_ours = threading.current_thread() is threading.main_thread()
    if not is_ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    first: list[float] = []

    def interrupt(*given: object) -> None:
        if first and time.monotonic() < first[0] + GRACE_PERIOD:
            return
        first[:] = [time.monotonic()]
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
