"""Cache: compiled programs, kept per user, so that the same C is compiled once.

A key is the digest of sources, compiler and flags. The folder is the user's own and closed to
others (0700); one that is not is left alone, and programs are compiled anew each time.
"""

from __future__ import annotations

import hashlib
import logging
import os
import stat
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path

CACHE_VARIABLE = "MODEWRIGHT_CACHE"
KEY_LENGTH = 64
MAX_PROGRAMS = 200
"""Programs kept; beyond, those not used for a day go, the oldest first (100 kB each)."""
PROGRAM_SUFFIXES = ("", ".so")
"""Of programs: what else has a key, such as thresholds of a bootstrap, is small and stays."""
DAY = 86400.0
HOUR = 3600.0
CLEANUP_STAMP = "tidied"
"""A file whose age tells when its folder was looked through: not with each program, a look at
thousands of them takes as long as a small program to compile."""
log = logging.getLogger("modewright.cache")


def cache_folder() -> Path:
    """Return where programs are kept: $MODEWRIGHT_CACHE, else below the user's cache folder."""
    if given := os.environ.get(CACHE_VARIABLE):
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME", "")
    return Path(base if os.path.isabs(base) else Path.home() / ".cache") / "modewright"


def cache_fault(folder: Path) -> str:
    """Return why a folder must not be used as a cache; an empty text if it may be."""
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
    """Return the folder inside the cache where others than programs are kept; None without one."""
    folder, fault = _locate_folder(subfolder)
    return None if fault else folder


def _locate_folder(subfolder: str) -> tuple[Path, str]:
    """Return the cache or a `subfolder` inside it, and why it must not be used, if it must not."""
    try:
        folder = cache_folder()
        fault = cache_fault(folder)
        if subfolder and not fault:
            folder /= subfolder
            fault = cache_fault(folder)
    except (OSError, RuntimeError) as error:  # no home folder
        return Path(), str(error)
    return folder, fault


def key_of(
    sources: Sequence[Path],
    command: Sequence[str],
    version: str,
    dependencies: Iterable[Path] | None = None,
) -> str:
    """Return the key of a program: what is compiled, all in one folder, by what, and how.

    `dependencies` are the files of that folder that it follows from, if not all of them.
    """
    digest = hashlib.sha256()
    for text in (*command, version, *(path.name for path in sources)):
        digest.update(text.encode() + b"\0")
    folder = sources[0].parent
    found = folder.rglob("*") if dependencies is None else dependencies
    for path in sorted(path for path in found if path.is_file()):
        name = path.relative_to(folder).as_posix()
        digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def get_or_build(
    key: str, build: Callable[[Path], None], fallback_folder: Path, subfolder: str = ""
) -> Path:
    """Return the program of a key, made by `build` if it is not kept; in `fallback_folder` without a cache.

    `subfolder` is the folder inside the cache where others than programs are kept.
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
    """Tell whether a kept program is the user's own, whole, and may be run."""
    try:
        status = target.lstat()
        expected_digest = _digest_file(target).read_text()
        data = target.read_bytes()
    except (OSError, UnicodeDecodeError):
        return False
    is_own = stat.S_ISREG(status.st_mode) and status.st_uid == os.getuid()
    is_closed = not status.st_mode & 0o022
    is_whole = hashlib.sha256(data).hexdigest() == expected_digest
    return is_own and is_closed and is_whole and os.access(target, os.X_OK)


def _store(built: Path, target: Path) -> None:
    """Copy a program and the digest of its bytes beside it, each whole or not at all."""
    data = built.read_bytes()
    digest = hashlib.sha256(data).hexdigest().encode()
    for path, content, mode in ((target, data, 0o700), (_digest_file(target), digest, 0o600)):
        handle, name = tempfile.mkstemp(dir=target.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.chmod(name, mode)
            os.replace(name, path)
        except OSError:
            Path(name).unlink(missing_ok=True)
            raise


def _digest_file(target: Path) -> Path:
    return target.with_name(target.name + ".sha256")


def remove_old_programs(folder: Path) -> None:
    """Remove the oldest programs that are kept in a folder, and in each inside it; look for them
    once an hour at most.

    What belongs to a program begins with its key. Reading counts as use where the system tells it.
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
                found = path.stat()
                used[key] = max(used.get(key, 0.0), found.st_mtime, found.st_atime)
                files.setdefault(key, []).append(path)
    programs = [key for key in used if any(path.suffix in PROGRAM_SUFFIXES for path in files[key])]
    newest_first = sorted(programs, key=lambda key: -used[key])
    for key in newest_first[MAX_PROGRAMS:]:
        if time.time() - used[key] > DAY:
            for path in files[key]:
                path.unlink(missing_ok=True)
