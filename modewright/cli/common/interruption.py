"""Interruption: end the process in order at Ctrl-C and at the signals that ask it to end."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

GRACE_PERIOD = 15.0
"""Time [s] after a signal in which further ones are ignored."""
TERMINATION_SIGNALS = (signal.SIGTERM, signal.SIGHUP)
"""Signals by which the system or the terminal asks a process to end."""
SIGNAL_EXIT_CODE = 128
"""The exit code of a process that ends by a signal is this number plus that of the signal."""


class SignalInterrupt(KeyboardInterrupt):
    """An interrupt by a signal.

    It is a class of its own because of a rule of CPython: if an exception of exactly the class
    KeyboardInterrupt leaves a text that `exec` runs, as in the creation of a dataclass, the process
    ends by SIGINT, whatever its exit code is.
    """


@dataclass
class ReceivedSignal:
    """The last signal that was converted to an interrupt; the number 0 if there is none."""

    number: int = 0

    @property
    def exit_code(self) -> int:
        """The exit code of a process that ends by the signal (143 for SIGTERM); 0 without one."""
        return SIGNAL_EXIT_CODE + self.number if self.number else 0


@contextmanager
def convert_signals(numbers: Sequence[int] = TERMINATION_SIGNALS) -> Iterator[ReceivedSignal]:
    """Raise SignalInterrupt at the first of the signals; ignore others for GRACE_PERIOD.

    The interrupt unwinds the stack like a Ctrl-C, so that temporary files are removed. Yields the
    received signal. The process is about to exit at the end of the context, so the signals are
    ignored from then on. Signals that the process ignores before (`nohup`) stay ignored. This does
    nothing outside the main thread.
    """
    received = ReceivedSignal()
    if threading.current_thread() is not threading.main_thread():
        yield received
        return

    def store_number(number: int) -> None:
        received.number = number

    handler = _interrupt_once(store_number)
    changed = [each for each in numbers if signal.getsignal(each) is not signal.SIG_IGN]
    for number in changed:
        signal.signal(number, handler)
    try:
        yield received
    finally:
        for number in changed:
            signal.signal(number, signal.SIG_IGN)


@contextmanager
def debounce_interrupts() -> Iterator[None]:
    """Raise SignalInterrupt at the first Ctrl-C in the context; ignore others for GRACE_PERIOD.

    A Ctrl-C after this time raises again. The default handler is restored at the end. This does
    nothing outside the main thread or with another handler of SIGINT.
    """
    is_ours = threading.current_thread() is threading.main_thread()
    if not is_ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _interrupt_once(lambda number: None))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _interrupt_once(store_number: Callable[[int], None]) -> Callable[[int, object], None]:
    """Return a signal handler that raises SignalInterrupt, but not within GRACE_PERIOD again.

    It calls `store_number` with the number of each signal before it raises.
    """
    first: list[float] = []

    def interrupt(number: int, _frame: object) -> None:
        if first and time.monotonic() < first[0] + GRACE_PERIOD:
            return
        first[:] = [time.monotonic()]
        store_number(number)
        raise SignalInterrupt

    return interrupt
