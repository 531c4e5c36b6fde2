"""Regular file: open a file that a user names, unless it is a folder, a pipe or a device.

A pipe without a writer would block the process for ever, and a device may be endless. All packages
open such files here.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

NOT_REGULAR = "it is a folder, a pipe or a device"
"""Reason for which a file is refused, in `strerror` of the error."""
NON_BLOCKING = getattr(os, "O_NONBLOCK", 0)
"""Flag with which a pipe opens at once; it has no effect on regular files."""


def open_regular_file(path: Path) -> BinaryIO:
    """Return a regular file, opened for reading; symbolic links are followed.

    Raises OSError, with NOT_REGULAR as `strerror` for a folder, a pipe, a socket and a device; and
    ValueError for a path with a NUL character.
    """
    try:
        handle = os.open(path, os.O_RDONLY | NON_BLOCKING | getattr(os, "O_BINARY", 0))
    except OSError as error:
        if error.errno == errno.ENXIO:  # a socket
            raise _refusal(path) from None
        raise
    return _checked(handle, path, "rb")


def read_regular_bytes(path: Path, max_bytes: int = -1) -> bytes:
    """Return the content of a regular file, or its first `max_bytes` bytes if that is not negative.

    Raises the errors of `open_regular_file`.
    """
    with open_regular_file(path) as file:
        return file.read(max_bytes)


def open_lock_file(path: Path) -> BinaryIO:
    """Return a file that processes lock, opened for writing and created if it is missing.

    The content is left as it is. Raises OSError, also for a symbolic link (ELOOP), through which
    another file could be changed, and for what is no regular file.
    """
    flags = os.O_RDWR | os.O_CREAT | NON_BLOCKING | getattr(os, "O_NOFOLLOW", 0)
    return _checked(os.open(path, flags | getattr(os, "O_CLOEXEC", 0), 0o666), path, "r+b")


def _checked(handle: int, path: Path, mode: str) -> BinaryIO:
    """Return the file of a handle; closes it and raises OSError if it is no regular file."""
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise _refusal(path)
    file: BinaryIO = os.fdopen(handle, mode)  # type: ignore[assignment]
    return file


def _refusal(path: Path) -> OSError:
    """Return the error for a file that is no regular file."""
    return OSError(errno.EINVAL, NOT_REGULAR, str(path))
