"""Files: outputs are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path


class OutputError(Exception):
    """An output cannot be written; the message says which and why."""


def make_folder(folder: Path) -> None:
    """Make a folder and those above it. Raises OutputError."""
    if folder.is_symlink() and not folder.exists():
        raise OutputError(f"{folder}: this is a link to what is not there")
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: this is a file; name a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}") from None


def require_writable(*paths: Path | None) -> None:
    """Raise OutputError, before any work is done, for a path that cannot be written."""
    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise OutputError(f"{path}: this is a folder; name a file in it")
        folder = path.parent
        if not folder.is_dir():
            raise OutputError(f"{path}: there is no folder {folder}")
        if not os.access(folder, os.W_OK):
            raise OutputError(f"{path}: the folder {folder} is not writable")


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write all files or, if one cannot be written, none. Raises OutputError."""
    made: list[tuple[str, Path]] = []
    current = Path()
    try:
        for path, data in files.items():
            current = path
            handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
            made.append((name, path))
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            os.chmod(name, 0o644)
        while made:
            name, current = made[0]
            os.replace(name, current)
            made.pop(0)
    except OSError as error:
        raise OutputError(f"{current}: {error.strerror}") from None
    finally:
        for name, _ in made:
            Path(name).unlink(missing_ok=True)


def remove_files(paths: Iterable[Path]) -> None:
    """Remove files. Raises OutputError."""
    for path in paths:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"{path}: {error.strerror}") from None
