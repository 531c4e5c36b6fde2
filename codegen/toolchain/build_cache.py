"""Build cache: compiled programs of a user, so that the same C is compiled once.

A key is the digest of the sources, the compiler and its flags. The folder belongs to the user and
is closed to others (mode 0700). Any other folder is not used, and programs are compiled each time.
Every file of the cache is sealed: a digest of its content is stored, and a file whose content has
another digest is made anew. The digest of a program is in a file beside it, because the linker and
the loader read the program; all other files begin with their digest (`write_sealed`).
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

from language.text.regular_file import read_regular_bytes
from language.text.temporary_files import (
    TEMPORARY_PREFIX,
    require_temporary_space,
    write_atomically,
)

CACHE_VARIABLE = "MODEWRIGHT_CACHE"
"""The environment variable with the folder of the cache."""
KEY_LENGTH = 64
"""Number of characters of a key."""
SEAL_LENGTH = 32
"""Number of bytes of the digest at the beginning of a sealed file."""
MAX_PROGRAMS = 200
"""Number of programs that are always kept (100 kB each). Of more, those not used for a day are
removed, the oldest first."""
PROGRAM_SUFFIXES = ("", ".so")
"""Suffixes of programs. Other entries with a key, such as thresholds of a bootstrap, are small and
are never removed."""
DAY = 86400.0
"""A day [s]."""
HOUR = 3600.0
"""An hour [s]."""
CLEANUP_STAMP = "tidied"
"""A file whose modification time is that of the last clean-up. A clean-up lists thousands of files,
which takes as long as the compilation of a small program, so it is not done for each program."""
log = logging.getLogger("modewright.cache")


def cache_folder() -> Path:
    """Return the folder of the cache: $MODEWRIGHT_CACHE, else the user's default.

    The latter is `modewright` in $XDG_CACHE_HOME if that is an absolute path, else in `~/.cache`.
    A user without a home folder has a private temporary folder, until the process ends; otherwise
    nothing is created. Raises OSError if that folder cannot be created.
    """
    if given := os.environ.get(CACHE_VARIABLE):
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME", "")
    if os.path.isabs(base):
        return Path(base) / "modewright"
    try:
        return Path.home() / ".cache" / "modewright"
    except RuntimeError:  # neither HOME nor an entry of the user in the list of users
        return _temporary_cache()


@cache
def _temporary_cache() -> Path:
    """Return a temporary folder, the same at each call, which is removed when the process ends."""
    require_temporary_space()
    folder = Path(tempfile.mkdtemp(prefix=f"{TEMPORARY_PREFIX}cache-"))
    log.info("there is no home folder; programs are kept in %s until the end", folder)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def cache_fault(folder: Path) -> str:
    """Return the reason why a folder must not be used as a cache; an empty text if it may.

    It must be a folder (no link) of the user, writable, and closed to others. It is created with
    mode 0700, with its parents, if it does not exist. Raises nothing.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.lstat()
    except OSError as error:
        return f"{folder} cannot be made: {error.strerror}"
    if not stat.S_ISDIR(status.st_mode):
        return f"{folder} is not a folder"
    if status.st_uid != os.getuid():
        return f"{folder} belongs to another user"
    if status.st_mode & 0o077:
        return f"{folder} is open to other users: chmod 700 {folder}"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"{folder} is not writable"
    return ""


def cache_subfolder(subfolder: str) -> Path | None:
    """Return a folder inside the cache for other contents than programs, created if it is missing.

    Returns None if the cache or the folder cannot be used (`cache_fault`).
    """
    folder, fault = _locate_folder(subfolder)
    return None if fault else folder


def _locate_folder(subfolder: str) -> tuple[Path, str]:
    """Return the cache, or a `subfolder` of it, and why it must not be used, else ""."""
    try:
        folder = cache_folder()
        fault = cache_fault(folder)
        if subfolder and not fault:
            folder /= subfolder
            fault = cache_fault(folder)
    except OSError as error:  # no home folder and no temporary folder
        return Path(), str(error)
    return folder, fault


def key_of(
    sources: Sequence[Path],
    command: Sequence[str],
    version: str,
    dependencies: Iterable[Path] | None = None,
) -> str:
    """Return the key of a program: a SHA-256 of its sources, compiler command and version, in hex.

    The digest covers the names of the sources, and name and contents of all files below the folder
    of the first source, or only of `dependencies`, which are in that folder.
    """
    digest = hashlib.sha256()
    for text in (*command, version, *(path.name for path in sources)):
        digest.update(text.encode() + b"\0")
    folder = sources[0].parent
    files = folder.rglob("*") if dependencies is None else dependencies
    for path in sorted(path for path in files if path.is_file()):
        name = path.relative_to(folder).as_posix()
        digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def get_or_build(
    key: str, build: Callable[[Path], None], fallback_folder: Path, subfolder: str = ""
) -> Path:
    """Return the path of the program with a key, built by `build` if it is not in the cache.

    `build` writes to the path that it is given, `program` in `fallback_folder`; its errors pass. A
    cached program is used if it belongs to the user, is executable and has its digest. If the cache
    cannot be used, the program stays in `fallback_folder`, and a warning is logged. `subfolder` is
    a folder inside the cache. Storing a program removes old ones.
    """
    folder, fault = _locate_folder(subfolder)
    if fault:
        log.warning("nothing is kept: %s", fault)
        build(fallback_folder / "program")
        return fallback_folder / "program"
    target = folder / key
    if _is_valid(target):
        log.debug("compiled before: %s", target)
        with suppress(OSError):
            os.utime(target)
        return target
    build(fallback_folder / "program")
    log.info("compiled: %s", target)
    try:
        _store(fallback_folder / "program", target)
        remove_old_programs(folder)
    except OSError as error:
        log.warning("not kept: %s", error)
        return fallback_folder / "program"
    return target if os.access(target, os.X_OK) else fallback_folder / "program"


def _is_valid(target: Path) -> bool:
    """Tell whether a cached program belongs to the user, is executable and is intact."""
    try:
        status = target.lstat()
        expected_digest = read_regular_bytes(_digest_file(target)).decode()
        data = read_regular_bytes(target)
    except (OSError, UnicodeDecodeError):
        return False
    is_own = stat.S_ISREG(status.st_mode) and status.st_uid == os.getuid()
    is_closed = not status.st_mode & 0o022
    is_whole = hashlib.sha256(data).hexdigest() == expected_digest
    return is_own and is_closed and is_whole and os.access(target, os.X_OK)


def _store(built: Path, target: Path) -> None:
    """Copy a program and its digest into the cache; each file is replaced atomically."""
    data = built.read_bytes()
    digest = hashlib.sha256(data).hexdigest().encode()
    for path, content, mode in ((target, data, 0o700), (_digest_file(target), digest, 0o600)):
        write_atomically(path, content, mode)


def _digest_file(target: Path) -> Path:
    """Return the path of the file with the digest of a program."""
    return target.with_name(target.name + ".sha256")


def write_sealed(path: Path, data: bytes) -> None:
    """Write data to a file of the cache that is no program, behind their SHA-256 (32 bytes).

    The file is replaced atomically. Raises OSError.
    """
    write_atomically(path, hashlib.sha256(data).digest() + data)


def read_sealed(path: Path) -> bytes | None:
    """Return the data of a file that `write_sealed` wrote; None if it is missing or damaged.

    A file is damaged if its data have another digest than the stored one. Links, folders and pipes
    are not read. Raises nothing.
    """
    try:
        content = path.read_bytes() if stat.S_ISREG(path.lstat().st_mode) else b""
    except OSError:
        return None
    seal, data = content[:SEAL_LENGTH], content[SEAL_LENGTH:]
    return data if hashlib.sha256(data).digest() == seal else None


def remove_old_programs(folder: Path) -> None:
    """Remove the oldest programs of a folder and of its subfolders, at most once an hour each.

    The MAX_PROGRAMS programs that were used last stay, as do those used within a day. A program is
    removed together with all files whose names begin with its key. The time of use is the later of
    the access and modification times. Writes the file CLEANUP_STAMP. Raises OSError.
    """
    stamp = folder / CLEANUP_STAMP
    with suppress(OSError):
        if abs(time.time() - stamp.stat().st_mtime) < HOUR:
            return
    stamp.touch(mode=0o600)
    used: dict[str, float] = {}
    files: dict[str, list[Path]] = {}
    for path in folder.iterdir():
        key = path.name[:KEY_LENGTH]
        if path.is_dir() and not path.is_symlink():
            remove_old_programs(path)
        elif len(key) == KEY_LENGTH:
            with suppress(OSError):  # another process may have removed it
                status = path.stat()
                used[key] = max(used.get(key, 0.0), status.st_mtime, status.st_atime)
                files.setdefault(key, []).append(path)
    programs = [key for key in used if any(path.suffix in PROGRAM_SUFFIXES for path in files[key])]
    newest_first = sorted(programs, key=lambda key: -used[key])
    for key in newest_first[MAX_PROGRAMS:]:
        if time.time() - used[key] > DAY:
            for path in files[key]:
                path.unlink(missing_ok=True)
