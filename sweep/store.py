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

from language.problem import SpecError
from sweep.block import Block, Row
from sweep.manifest import MANIFEST, Manifest, manifest_json, read_manifest, refused
from sweep.rows_file import arrow_module, block_file, columns_of_file, mark_of

BLOCKS = "blocks"
LOCK = ".lock"
NAME = re.compile(r"(\d{10})-(\d{10})\.parquet")


@dataclass(frozen=True)
class Store:
    """The results of one study in a folder."""

    folder: Path
    manifest: Manifest

    def finished(self) -> set[int]:
        """Return the starts of the blocks that are there; one that cannot be read is removed.

        Each is read whole: what is summed up later is what was computed.
        """
        known, found = set(self.manifest.blocks), set()
        for path, block in self._files():
            if block in known and self._is_fine(path, block):
                found.add(block.start)
            else:
                path.unlink(missing_ok=True)
        return found

    def _is_fine(self, path: Path, block: Block) -> bool:
        try:
            rows = columns_of_file(path)
        except SpecError:
            return False
        mine = (rows.schema.metadata or {}).get(b"modewright") == mark_of(self.manifest, block)
        return mine and rows.num_rows == block.stop - block.start

    def _files(self) -> Iterator[tuple[Path, Block]]:
        for path in sorted((self.folder / BLOCKS).iterdir()):
            match = NAME.fullmatch(path.name)
            if match:
                yield path, Block(int(match[1]), int(match[2]))

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
    if (folder / MANIFEST).exists():
        there = read_manifest(folder)
        if there.digest != wanted.digest:
            raise _another(folder, there, wanted)
        wanted = dataclasses.replace(wanted, block=there.block)
    elif folder.is_dir() and any(p.name != LOCK and p.suffix != ".part" for p in folder.iterdir()):
        label = "this folder holds something else than the results of a study"
        raise refused(folder, "store", label, "name another folder, or a new one")
    (folder / BLOCKS).mkdir(parents=True, exist_ok=True)
    write_whole(folder / MANIFEST, manifest_json(wanted))
    store = Store(folder, wanted)
    store.clear_leftovers()
    return store


def read_store(folder: Path) -> Store:
    """Open a store to read from it. Raises SpecError, ToolMissing."""
    arrow_module()
    return Store(folder, read_manifest(folder))


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
