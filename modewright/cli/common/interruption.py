"""Interruption: handle repeated Ctrl-C as one interrupt."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

GRACE_PERIOD = 15.0
"""Time [s] after a Ctrl-C in which further ones are ignored."""


@contextmanager
def debounce_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt at the first Ctrl-C in the context; ignore others for GRACE_PERIOD.

    A Ctrl-C after this time raises again. The default handler is restored at the end. This does
    nothing outside the main thread or with another handler of SIGINT.
    """
    is_ours = threading.current_thread() is threading.main_thread()
    if not is_ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    first: list[float] = []

    def interrupt(*_given: object) -> None:
        if first and time.monotonic() < first[0] + GRACE_PERIOD:
            return
        first[:] = [time.monotonic()]
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
