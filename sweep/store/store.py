"""Store: write the results of a study into a folder with one Parquet file for each block.

`study.json` is the manifest; `blocks/<start>-<stop>.parquet` holds the variants from `start` to
`stop` (exclusive). Each file is written under a temporary name, flushed to the disk and renamed.
Hence a file with a final name is complete, also after a crash.
"""

from __future__ import annotations

import dataclasses
import errno
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from language.text.diagnostic import Problems, SpecError
from language.text.regular_file import open_lock_file, read_regular_bytes
from sweep.store.block_file import block_file_fault, encode_block, import_arrow
from sweep.store.manifest import MANIFEST_NAME, Manifest, encode_manifest, file_span, store_error
from sweep.store.manifest_reader import read_manifest
from sweep.store.row import Block, Row

BLOCKS_FOLDER = "blocks"
"""The folder of block files in a store."""
LOCK_NAME = ".lock"
"""The name of the lock file."""
BLOCK_NAME = re.compile(r"(\d{10})-(\d{10})\.parquet", re.ASCII)
"""The form of the names of block files."""
RERUN_HINT = "the sweep that made these results computes them again: the same command"
"""Hint for missing or damaged blocks."""


@dataclass(frozen=True)
class StoreContents:
    """The complete blocks of a store, and the files of damaged ones.

    A damaged block counts as missing: the next run computes and replaces it.
    """

    complete: tuple[Block, ...]
    damaged: tuple[Path, ...]


@dataclass(frozen=True)
class Store:
    """The results of one study in a folder."""

    folder: Path
    manifest: Manifest

    def scan(self) -> StoreContents:
        """Return the complete and the damaged blocks, each in ascending order, by `fault_of`.

        Blocks without a file are in neither; files with other names are ignored. Raises SpecError
        for unreadable files, for blocks of other studies or of another block size, and without the
        folder of blocks. Nothing is changed.
        """
        whole, damaged, problems = [], [], Problems()
        for path, block in self._files():
            try:
                fault = block_file_fault(self.manifest, block, read_regular_bytes(path))
            except OSError as error:
                problems.error("store", file_span(path), f"this cannot be read: {error.strerror}")
                continue
            if fault == "another" or not self.manifest.has(block):
                label = f"this is no block of the results of `{self.manifest.study}` here"
                problems.error("store", file_span(path), label, "move it elsewhere")
            elif fault:
                damaged.append(path)
            else:
                whole.append(block)
        problems.raise_if_errors()
        return StoreContents(tuple(whole), tuple(damaged))

    def finished_starts(self) -> set[int]:
        """Return the starts of the complete blocks. Raises SpecError as `scan` does."""
        return {block.start for block in self.scan().complete}

    def _files(self) -> Iterator[tuple[Path, Block]]:
        """Yield the paths of the block files in ascending order, with the blocks that their names
        denote.

        Raises SpecError if the folder of blocks is missing.
        """
        try:
            names = sorted(path.name for path in (self.folder / BLOCKS_FOLDER).iterdir())
        except (FileNotFoundError, NotADirectoryError):
            label = f"the folder `{BLOCKS_FOLDER}` is missing, and with it the results"
            raise store_error(self.folder, label, RERUN_HINT) from None
        for name in names:
            match = BLOCK_NAME.fullmatch(name)
            if match:
                yield self.folder / BLOCKS_FOLDER / name, Block(int(match[1]), int(match[2]))

    def paths(self) -> list[Path]:
        """Return the paths of all block files by name, in ascending order; they are not checked.

        Raises SpecError if the folder of blocks is missing.
        """
        return [path for path, _ in self._files()]

    def write_rows(self, block: Block, rows: Sequence[Row]) -> None:
        """Encode the rows of a block and write its file atomically, as `write_block_file` does.

        Raises OSError, MissingToolError.
        """
        self.write_block_file(block, encode_block(self.manifest, block, rows))

    def write_block_file(self, block: Block, data: bytes) -> None:
        """Write an encoded block atomically to `blocks/<start>-<stop>.parquet`.

        Both numbers have ten digits. An existing file is replaced. Raises OSError.
        """
        path = self.folder / BLOCKS_FOLDER / f"{block.start:010d}-{block.stop:010d}.parquet"
        write_atomically(path, data)

    def remove_partial_files(self) -> None:
        """Remove the temporary files `.*.part` of the store that an interrupted process left."""
        for folder in (self.folder, self.folder / BLOCKS_FOLDER):
            for path in folder.glob(".*.part"):
                path.unlink(missing_ok=True)


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file under a temporary name, flush it to the disk and rename it.

    The temporary file is `.<name>.<process>.part` in the same folder; it is removed after an error.
    An existing file is replaced. Raises OSError.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.unlink(missing_ok=True)  # never write through a link of this name
        with part.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise
    _flush_folder(path.parent)


def _flush_folder(folder: Path) -> None:
    """Flush a folder's directory entries to the disk if the system supports it."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def open_store(folder: Path, manifest: Manifest) -> Store:
    """Create a store in a folder, or open an existing one of the same study.

    An existing store keeps its block size; the manifest is written anew, and temporary files are
    removed. Raises SpecError if the folder contains something else, OSError, and MissingToolError
    without pyarrow.
    """
    import_arrow()
    stored = require_same_study(folder, manifest)
    if stored:
        manifest = dataclasses.replace(manifest, block_size=stored.block_size)
    (folder / BLOCKS_FOLDER).mkdir(parents=True, exist_ok=True)
    write_atomically(folder / MANIFEST_NAME, encode_manifest(manifest))
    store = Store(folder, manifest)
    store.remove_partial_files()
    return store


def require_same_study(folder: Path, manifest: Manifest) -> Manifest | None:
    """Return the manifest in a folder; None if the folder is missing or empty.

    A lock and temporary files do not count. Raises SpecError if it belongs to another study (its
    digest differs; the changed parts are named), has a damaged manifest, or contains something
    else.
    """
    if (folder / MANIFEST_NAME).exists():
        stored = read_manifest(folder)
        if stored.digest != manifest.digest:
            raise _changed_study_error(folder, stored, manifest)
        return stored
    if folder.is_dir() and any(
        p.name != LOCK_NAME and p.suffix != ".part" for p in folder.iterdir()
    ):
        label = "this folder holds something else than the results of a study"
        raise store_error(folder, label, "name another folder, or a new one")
    return None


def read_store(folder: Path) -> Store:
    """Open a store for reading; blocks may be missing.

    Raises SpecError for an invalid manifest, for the problems of `scan` and for a damaged block;
    MissingToolError without pyarrow.
    """
    import_arrow()
    store = Store(folder, read_manifest(folder))
    problems = Problems()
    for path in store.scan().damaged:
        label = "this block is damaged: its bytes are not those that were written"
        problems.error("store", file_span(path), label, RERUN_HINT)
    problems.raise_if_errors()
    return store


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Lock a folder against writing by other processes; the lock ends with the context or process.

    The folder and the file LOCK_NAME in it are created. Raises SpecError if another process has the
    lock, and if LOCK_NAME cannot be opened or is a link, a pipe or a device. Systems without fcntl
    have no lock.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        import fcntl
    except ImportError:  # no such locks on this system
        yield
        return
    try:
        lock = open_lock_file(folder / LOCK_NAME)
    except OSError as error:
        is_link = error.errno == errno.ELOOP
        reason = "it is a link to another file" if is_link else error.strerror
        label = f"the file `{LOCK_NAME}` of these results cannot be locked: {reason}"
        raise store_error(folder, label, f"remove `{LOCK_NAME}`, or name another folder") from None
    with lock as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            label = "another process is writing into this folder"
            raise store_error(folder, label, "wait for it, or name another folder") from None
        try:
            yield
        finally:  # explicit: a child process may still share the file
            fcntl.flock(file, fcntl.LOCK_UN)


def _changed_study_error(folder: Path, found: Manifest, expected: Manifest) -> SpecError:
    """Return the error that names the parts of the study that changed since the stored results."""
    names = dict.fromkeys([*found.identity, *expected.identity])
    other = [n for n in names if found.identity.get(n) != expected.identity.get(n)]
    parts = f"{', '.join(other[:3])}{' ...' if len(other) > 3 else ''}"
    label = f"the results here are of another state of `{found.study}`: {parts} changed"
    return store_error(folder, label, "name another folder with --out, or undo the change")
