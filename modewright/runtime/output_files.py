"""Output files: check paths and write files atomically."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from language.text.sanitise import truncate
from language.text.temporary_files import postpone_signals

DEFAULT_FILE_MODE = 0o644
"""Mode of new files."""
SPEC_SUFFIXES = (".yaml", ".yml")
"""Suffixes of specs, which outputs must not replace."""
RESULT_NAMES = ("study.json", "blocks")
"""The parts of a store of results, see sweep/store/store.py."""
STUDY_FOLDER_NAMES = (*RESULT_NAMES, "plots", ".lock")
"""All names that a run of a study writes into its folder."""


class OutputError(Exception):
    """An output cannot be written; the message states which and why."""


def resolve_output(path: Path) -> Path:
    """Return the absolute path of an output without links; it need not exist.

    Raises OutputError if the operating system cannot follow the path: for a loop of links, a name
    that is too long, a character that no name may have, and a folder that may not be read.
    """
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError as error:
        raise OutputError(f"{truncate(str(path))}: {error.strerror}") from None
    except ValueError:
        raise OutputError(f"{str(path)!r}: this is no name of a file") from None
    return path.resolve()


def make_folder(folder: Path) -> None:
    """Create a folder and its missing parents; an existing folder is accepted.

    Raises OutputError if the path is a file or a broken link, or cannot be created.
    """
    resolve_output(folder)
    if folder.is_symlink() and not folder.exists():
        raise OutputError(f"{folder}: this is a link to what is not there")
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: this is a file; name a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror}") from None


def require_writable(*paths: Path | None) -> None:
    """Raise OutputError for the first path that must not or cannot be written.

    These are existing files with one of SPEC_SUFFIXES, parts of a store of results (RESULT_NAMES),
    and paths that `require_writable_location` rejects. None is skipped. Commands call this before
    the computation.
    """
    for path in paths:
        if path is None:
            continue
        place = resolve_output(path)
        if place.exists() and place.suffix in SPEC_SUFFIXES:
            raise OutputError(f"{path}: this is a spec; an output would replace it")
        if any(_is_result(one) for one in (place, place.parent)):
            raise OutputError(f"{path}: this is a part of the results of a study")
        require_writable_location(path)


def _is_result(place: Path) -> bool:
    """Return whether a path is a part of a store of results."""
    folder = place.parent
    is_store = (folder / RESULT_NAMES[0]).is_file() and (folder / RESULT_NAMES[1]).is_dir()
    return is_store and place.name in RESULT_NAMES


def require_separate_outputs(results: Path, *paths: Path | None) -> None:
    """Raise OutputError if two outputs are one file or an output is a part of a study's results.

    Parts are STUDY_FOLDER_NAMES in the folder `results`; other outputs may be in it, even if it
    does not exist yet. All must also pass `require_writable`. None is skipped.
    """
    folder, claimed = resolve_output(results), set[Path]()
    for path in paths:
        if path is None:
            continue
        place = resolve_output(path)
        if place in claimed:
            raise OutputError(f"{path}: this is the name of two outputs")
        claimed.add(place)
        if any(place.is_relative_to(folder / name) for name in STUDY_FOLDER_NAMES):
            raise OutputError(f"{path}: this is a part of the results of the study")
        if place.parent != folder or folder.exists():
            require_writable(path)


def require_calibration_output(path: Path) -> None:
    """Raise OutputError for an existing file that is no calibration, or an unwritable path.

    A calibration has a line that starts with `calibration:`.
    """
    require_writable_location(path)
    if path.is_file() and not any(line.startswith(b"calibration:") for line in path.open("rb")):
        raise OutputError(f"{path}: this is no calibration; a new one would replace it")


def require_writable_location(path: Path) -> None:
    """Raise OutputError for a path at which no file can be written.

    This is a folder, a socket or block device, and a path whose folder is missing or not writable;
    a pipe or character device is accepted if it is writable. For a link the folder of its target
    counts. Nothing is created.
    """
    resolve_output(path)
    if path.is_dir():
        raise OutputError(f"{path}: this is a folder; name a file in it")
    if path.exists() and not path.is_file() and not _is_stream(path):
        raise OutputError(f"{path}: this is a device or a socket; name a file")
    folder = _resolve_link(path).parent
    if not folder.is_dir():
        raise OutputError(f"{path}: there is no folder {folder}")
    if not os.access(path if _is_stream(path) else folder, os.W_OK):
        what = f"{path}: this" if _is_stream(path) else f"{path}: the folder {folder}"
        raise OutputError(f"{what} is not writable")


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write all files atomically: none is replaced before all are written beside their targets.

    Existing files keep their mode, new ones have DEFAULT_FILE_MODE; for a link its target is
    replaced. A Ctrl-C or SIGTERM meanwhile takes effect when all files are replaced. Pipes and
    character devices are written last. Raises OutputError; then no temporary file is left over.
    """
    streams = {path: data for path, data in files.items() if _is_stream(path)}
    with postpone_signals():
        _replace_files({path: data for path, data in files.items() if path not in streams})
    for path, data in streams.items():
        try:
            with path.open("wb") as stream:
                stream.write(data)
        except OSError as error:
            raise OutputError(f"{path}: {error.strerror}") from None


def _replace_files(files: Mapping[Path, bytes]) -> None:
    """Write files beside their targets, then replace the targets in order. Raises OutputError."""
    temporary_files: list[tuple[str, Path]] = []
    current = Path()
    try:
        for path, data in files.items():
            current = path
            target = _resolve_link(path)
            handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
            temporary_files.append((name, target))
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            os.chmod(
                name, stat.S_IMODE(target.stat().st_mode) if target.exists() else DEFAULT_FILE_MODE
            )
        while temporary_files:
            name, current = temporary_files[0]
            os.replace(name, current)
            temporary_files.pop(0)
    except OSError as error:
        raise OutputError(f"{current}: {error.strerror}") from None
    finally:
        for name, _ in temporary_files:
            Path(name).unlink(missing_ok=True)


def _resolve_link(path: Path) -> Path:
    """Return the target of a link; other paths are unchanged."""
    return path.resolve() if path.is_symlink() and not _is_stream(path) else path


def _is_stream(path: Path) -> bool:
    """Return whether a path is a pipe or a character device."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISCHR(mode)


def remove_files(paths: Iterable[Path]) -> None:
    """Remove files in the given order; missing ones are ignored.

    Raises OutputError at the first one that cannot be removed.
    """
    for path in paths:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"{path}: {error.strerror}") from None
