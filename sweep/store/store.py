"""Store: results in a folder of Parquet files, one a block, each written whole or not at all.

`study.json` says of what study they are; `blocks/<start>-<stop>.parquet` holds the variants from
`start` to before `stop`. A file is written beside its name, flushed to the disk, then renamed: what
has its name is finished, whatever happens to the process.
"""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from language.text.diagnostic import Problems, SpecError
from sweep.store.block_file import encode_block, fault_of, import_arrow
from sweep.store.manifest import MANIFEST_NAME, Manifest, encode_manifest, file_span, store_error
from sweep.store.manifest_reader import read_manifest
from sweep.store.row import Block, Row

BLOCKS_FOLDER = "blocks"
LOCK_NAME = ".lock"
BLOCK_NAME = re.compile(r"(\d{10})-(\d{10})\.parquet", re.ASCII)
RERUN_HINT = "the sweep that made these results computes them again: the same command"


@dataclass(frozen=True)
class StoreContents:
    """The blocks of a store that are there, and files of blocks that are not as they were written.

    What is damaged counts as missing: it is computed again, and replaced.
    """

    complete: tuple[Block, ...]
    damaged: tuple[Path, ...]


@dataclass(frozen=True)
class Store:
    """The results of one study in a folder."""

    folder: Path
    manifest: Manifest

    def scan(self) -> StoreContents:
        """Return which blocks are there, as their digests tell.

        Raises SpecError for what is no block of these results; it is left where it is.
        """
        whole, damaged, problems = [], [], Problems()
        for path, block in self._files():
            try:
                fault = fault_of(self.manifest, block, path.read_bytes())
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
        """Return the starts of the blocks that are there and not damaged. Raises SpecError."""
        return {block.start for block in self.scan().complete}

    def _files(self) -> Iterator[tuple[Path, Block]]:
        try:
            names = sorted(path.name for path in (self.folder / BLOCKS_FOLDER).iterdir())
        except (FileNotFoundError, NotADirectoryError):
            label = f"the folder `{BLOCKS_FOLDER}` is missing, and with it the results"
            raise store_error(self.folder, "store", label, RERUN_HINT) from None
        for name in names:
            match = BLOCK_NAME.fullmatch(name)
            if match:
                yield self.folder / BLOCKS_FOLDER / name, Block(int(match[1]), int(match[2]))

    def paths(self) -> list[Path]:
        """Return the files of the finished blocks in their order."""
        return [path for path, _ in self._files()]

    def write_rows(self, block: Block, rows: Sequence[Row]) -> None:
        """Keep the rows of a block, whole or not at all. Raises OSError."""
        self.write_block_file(block, encode_block(self.manifest, block, rows))

    def write_block_file(self, block: Block, data: bytes) -> None:
        """Keep the file of a block, whole or not at all. Raises OSError."""
        path = self.folder / BLOCKS_FOLDER / f"{block.start:010d}-{block.stop:010d}.parquet"
        write_atomically(path, data)

    def remove_partial_files(self) -> None:
        """Remove what an interrupted process has left beside the finished files."""
        for folder in (self.folder, self.folder / BLOCKS_FOLDER):
            for path in folder.glob(".*.part"):
                path.unlink(missing_ok=True)


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file beside its name, flush it to the disk, rename it. Raises OSError."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
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
    """Flush the names in a folder to the disk, where the system knows that."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def open_store(folder: Path, manifest: Manifest) -> Store:
    """Make a store, or open the one that is there to go on with it.

    Raises SpecError where the folder holds results of something else, OSError, ToolMissing.
    """
    import_arrow()
    there = require_same_study(folder, manifest)
    if there:
        manifest = dataclasses.replace(manifest, block_size=there.block_size)
    (folder / BLOCKS_FOLDER).mkdir(parents=True, exist_ok=True)
    write_atomically(folder / MANIFEST_NAME, encode_manifest(manifest))
    store = Store(folder, manifest)
    store.remove_partial_files()
    return store


def require_same_study(folder: Path, manifest: Manifest) -> Manifest | None:
    """Return what is in a folder of the same results; None: it is empty, or not there.

    Raises SpecError where it holds something else.
    """
    if (folder / MANIFEST_NAME).exists():
        there = read_manifest(folder)
        if there.digest != manifest.digest:
            raise _changed_study_error(folder, there, manifest)
        return there
    if folder.is_dir() and any(
        p.name != LOCK_NAME and p.suffix != ".part" for p in folder.iterdir()
    ):
        label = "this folder holds something else than the results of a study"
        raise store_error(folder, "store", label, "name another folder, or a new one")
    return None


def read_store(folder: Path) -> Store:
    """Open a store to read from it. Raises SpecError: also for a damaged block; ToolMissing."""
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
    """Keep other processes from writing into the folder; the lock ends with the process.

    Raises SpecError where another one has it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        import fcntl
    except ImportError:  # no such locks on this system
        yield
        return
    with (folder / LOCK_NAME).open("wb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            label = "another process is writing into this folder"
            raise store_error(
                folder, "store", label, "wait for it, or name another folder"
            ) from None
        try:
            yield
        finally:  # by hand: a process that is just being started may still share the file
            fcntl.flock(file, fcntl.LOCK_UN)


def _changed_study_error(folder: Path, found: Manifest, expected: Manifest) -> SpecError:
    """Say which parts of the study are not those that the results are of."""
    names = dict.fromkeys([*found.identity, *expected.identity])
    other = [n for n in names if found.identity.get(n) != expected.identity.get(n)]
    parts = f"{', '.join(other[:3])}{' ...' if len(other) > 3 else ''}"
    label = f"the results here are of another state of `{found.study}`: {parts} changed"
    return store_error(folder, "store", label, "name another folder with --out, or undo the change")
