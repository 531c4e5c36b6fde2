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

from language.problem import Problems, SpecError
from sweep.block import Block, Row
from sweep.manifest import MANIFEST, Manifest, manifest_json, refused, start_of
from sweep.manifest_reader import read_manifest
from sweep.rows_file import arrow_module, block_file, fault_of

BLOCKS = "blocks"
LOCK = ".lock"
NAME = re.compile(r"(\d{10})-(\d{10})\.parquet", re.ASCII)
AGAIN = "the sweep that made these results computes them again: the same command"


@dataclass(frozen=True)
class Found:
    """The blocks of a store that are there, and files of blocks that are not as they were written.

    What is damaged counts as missing: it is computed again, and replaced.
    """

    whole: tuple[Block, ...]
    damaged: tuple[Path, ...]


@dataclass(frozen=True)
class Store:
    """The results of one study in a folder."""

    folder: Path
    manifest: Manifest

    def found(self) -> Found:
        """Return which blocks are there, as their digests tell.

        Raises SpecError for what is no block of these results; it is left where it is.
        """
        whole, damaged, problems = [], [], Problems()
        for path, block in self._files():
            try:
                fault = fault_of(self.manifest, block, path.read_bytes())
            except OSError as error:
                problems.error("store", start_of(path), f"this cannot be read: {error.strerror}")
                continue
            if fault == "another" or not self.manifest.has(block):
                label = f"this is no block of the results of `{self.manifest.study}` here"
                problems.error("store", start_of(path), label, "move it elsewhere")
            elif fault:
                damaged.append(path)
            else:
                whole.append(block)
        problems.stop_if_any()
        return Found(tuple(whole), tuple(damaged))

    def finished(self) -> set[int]:
        """Return the starts of the blocks that are there and not damaged. Raises SpecError."""
        return {block.start for block in self.found().whole}

    def _files(self) -> Iterator[tuple[Path, Block]]:
        try:
            names = sorted(path.name for path in (self.folder / BLOCKS).iterdir())
        except (FileNotFoundError, NotADirectoryError):
            label = f"the folder `{BLOCKS}` is missing, and with it the results"
            raise refused(self.folder, "store", label, AGAIN) from None
        for name in names:
            match = NAME.fullmatch(name)
            if match:
                yield self.folder / BLOCKS / name, Block(int(match[1]), int(match[2]))

    def paths(self) -> list[Path]:
        """Return the files of the finished blocks in their order."""
        return [path for path, _ in self._files()]

    def write(self, block: Block, rows: Sequence[Row]) -> None:
        """Keep the rows of a block, whole or not at all. Raises OSError."""
        self.keep(block, block_file(self.manifest, block, rows))

    def keep(self, block: Block, data: bytes) -> None:
        """Keep the file of a block, whole or not at all. Raises OSError."""
        path = self.folder / BLOCKS / f"{block.start:010d}-{block.stop:010d}.parquet"
        write_whole(path, data)

    def clear_leftovers(self) -> None:
        """Remove what an interrupted process has left beside the finished files."""
        for folder in (self.folder, self.folder / BLOCKS):
            for path in folder.glob(".*.part"):
                path.unlink(missing_ok=True)


def write_whole(path: Path, data: bytes) -> None:
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


def open_store(folder: Path, wanted: Manifest) -> Store:
    """Make a store, or open the one that is there to go on with it.

    Raises SpecError where the folder holds results of something else, OSError, ToolMissing.
    """
    arrow_module()
    there = require_own(folder, wanted)
    if there:
        wanted = dataclasses.replace(wanted, block=there.block)
    (folder / BLOCKS).mkdir(parents=True, exist_ok=True)
    write_whole(folder / MANIFEST, manifest_json(wanted))
    store = Store(folder, wanted)
    store.clear_leftovers()
    return store


def require_own(folder: Path, wanted: Manifest) -> Manifest | None:
    """Return what is in a folder of the same results; None: it is empty, or not there.

    Raises SpecError where it holds something else.
    """
    if (folder / MANIFEST).exists():
        there = read_manifest(folder)
        if there.digest != wanted.digest:
            raise _another(folder, there, wanted)
        return there
    if folder.is_dir() and any(p.name != LOCK and p.suffix != ".part" for p in folder.iterdir()):
        label = "this folder holds something else than the results of a study"
        raise refused(folder, "store", label, "name another folder, or a new one")
    return None


def read_store(folder: Path) -> Store:
    """Open a store to read from it. Raises SpecError: also for a damaged block; ToolMissing."""
    arrow_module()
    store = Store(folder, read_manifest(folder))
    problems = Problems()
    for path in store.found().damaged:
        label = "this block is damaged: its bytes are not those that were written"
        problems.error("store", start_of(path), label, AGAIN)
    problems.stop_if_any()
    return store


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes from writing into the folder; the lock ends with the process.

    Raises SpecError where another one has it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        import fcntl
    except ImportError:  # no such locks on this system
        yield
        return
    with (folder / LOCK).open("wb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            label = "another process is writing into this folder"
            raise refused(folder, "store", label, "wait for it, or name another folder") from None
        try:
            yield
        finally:  # by hand: a process that is just being started may still share the file
            fcntl.flock(file, fcntl.LOCK_UN)


def _another(folder: Path, there: Manifest, wanted: Manifest) -> SpecError:
    """Say which parts of the study are not those that the results are of."""
    names = dict.fromkeys([*there.identity, *wanted.identity])
    other = [n for n in names if there.identity.get(n) != wanted.identity.get(n)]
    parts = f"{', '.join(other[:3])}{' ...' if len(other) > 3 else ''}"
    label = f"the results here are of another state of `{there.study}`: {parts} changed"
    return refused(folder, "store", label, "name another folder with --out, or undo the change")
