"""Temporary files and folders: none is left over, whenever a signal arrives.

Files are written through them, so that they appear whole or not at all.
"""

from __future__ import annotations

import errno
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

POSTPONED_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end a process in the middle of its work."""
TEMPORARY_PREFIX = "modewright-"
"""Start of the names of temporary folders."""


@contextmanager
def postpone_signals() -> Iterator[None]:
    """Postpone POSTPONED_SIGNALS to the end of the context, where each is raised once.

    Ignored signals stay ignored. Python runs signal handlers in the main thread only; in another
    thread this does nothing.
    """
    handlers = {number: signal.getsignal(number) for number in POSTPONED_SIGNALS}
    changed = {int(k): each for k, each in handlers.items() if each not in (None, signal.SIG_IGN)}
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: dict[int, None] = {}

    def store_number(number: int, _frame: object) -> None:
        received[number] = None

    try:
        for number in changed:
            signal.signal(number, store_number)
        yield
    finally:
        for number, handler in changed.items():
            signal.signal(number, handler)
        for number in received:
            signal.raise_signal(number)


def write_atomically(path: Path, data: bytes, mode: int = 0o600) -> None:
    """Write a file through a temporary file in its folder, so that no reader sees a part of it.

    An existing file is replaced; the file gets the permissions `mode`. Raises OSError (also if the
    folder is missing); the temporary file is then removed.
    """
    with postpone_signals():
        handle, name = tempfile.mkstemp(dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            os.chmod(name, mode)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise


def require_temporary_space() -> None:
    """Raise OSError, ENOSPC, if none of the folders for temporary files can be written."""
    try:
        tempfile.gettempdir()
    except FileNotFoundError as error:
        reason = "no folder for temporary files can be written; free space, or set TMPDIR"
        raise OSError(errno.ENOSPC, f"{reason} ({error.strerror})") from None


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Return a context with a new temporary folder, which is removed at the end.

    Signals are postponed while it is created and removed. Raises OSError, ENOSPC if no folder for
    temporary files can be written.
    """
    folder = None
    try:
        with postpone_signals():
            require_temporary_space()
            folder = tempfile.TemporaryDirectory(
                prefix=TEMPORARY_PREFIX, ignore_cleanup_errors=True
            )
        yield Path(folder.name)
    finally:
        if folder is not None:
            with postpone_signals():
                folder.cleanup()
