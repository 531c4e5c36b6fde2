"""Store: results in a folder of Parquet files, one a block, each written whole or not at all.

`study.json` says of what study they are; `blocks/<start>-<stop>.parquet` holds the variants from
`start` to before `stop`. A file is written beside its name, flushed to the disk, then renamed: what
has its name is finished, whatever happens to the process.
"""

from __future__ import annotations

import dataclasses
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from language.missing import ToolMissing
from language.problem import Problems, Source, Span, SpecError
from sweep.block import Block, Row
from sweep.measure import Column, columns_of
from sweep.preparation import FORMAT, digest_of
from sweep.study import Presentation, Study

MANIFEST = "study.json"
BLOCKS = "blocks"
LOCK = ".lock"
NAME = re.compile(r"(\d{10})-(\d{10})\.parquet")
MOST_BLOCKS = 100
MOST_IN_BLOCK = 5000
FIXED = ("number", "variant", "scenario", "sample", "replicate", "seed")
"""The first columns; then what varies, `status`, `message`, the measures."""


@dataclass(frozen=True)
class Manifest:
    """What a store is of. `identity` are the digests of all that results depend on, by part."""

    study: str
    digest: str
    identity: Mapping[str, str]
    count: int
    block: int
    varied: tuple[Column, ...]
    words: Mapping[str, Sequence[str]]
    measures: tuple[Column, ...]
    presentation: Presentation

    @property
    def blocks(self) -> list[Block]:
        """All blocks in their order."""
        starts = range(0, self.count, self.block)
        return [Block(start, min(start + self.block, self.count)) for start in starts]


def manifest_of(study: Study, block: int | None = None) -> Manifest:
    """Return the manifest of a prepared study; about 100 blocks unless a size is given."""
    size = min(MOST_IN_BLOCK, max(1, -(-study.count // MOST_BLOCKS)))
    return Manifest(
        study=study.name,
        digest=digest_of(study.identity),
        identity=study.identity,
        count=study.count,
        block=block or size,
        varied=tuple(Column(varied.name, "real", varied.unit) for varied in study.varied),
        words={varied.name: varied.words for varied in study.varied if varied.words},
        measures=tuple(column for measure in study.measures for column in columns_of(measure)),
        presentation=study.presentation,
    )


@dataclass(frozen=True)
class Store:
    """The results of one study in a folder."""

    folder: Path
    manifest: Manifest

    def finished(self) -> set[int]:
        """Return the starts of the blocks that are there; one that cannot be read is removed."""
        arrow = arrow_module()
        found = set()
        for path, block in self._files():
            try:
                kept = arrow.parquet.read_metadata(path)
                mine = (kept.metadata or {}).get(b"modewright") == self._mark(block)
                fine = mine and kept.num_rows == block.stop - block.start
            except (OSError, arrow.ArrowException):
                fine = False
            if fine and block in self._known:
                found.add(block.start)
            else:
                path.unlink(missing_ok=True)
        return found

    def _mark(self, block: Block) -> bytes:
        return f"{self.manifest.digest} {block.start}-{block.stop}".encode()

    @property
    def _known(self) -> set[Block]:
        return set(self.manifest.blocks)

    def _files(self) -> Iterator[tuple[Path, Block]]:
        for path in sorted((self.folder / BLOCKS).iterdir()):
            match = NAME.fullmatch(path.name)
            if match:
                yield path, Block(int(match[1]), int(match[2]))

    def paths(self) -> list[Path]:
        """Return the files of the finished blocks in their order."""
        return [path for path, _ in self._files()]

    def write(self, block: Block, rows: Sequence[Row]) -> None:
        """Keep a block, whole or not at all. Raises OSError."""
        data = parquet_of(self.manifest, rows, self._mark(block))
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
        raise _refused(folder, "store", label, "name another folder, or a new one")
    (folder / BLOCKS).mkdir(parents=True, exist_ok=True)
    write_whole(folder / MANIFEST, _json(wanted))
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
            raise _refused(folder, "store", label, "wait for it, or name another folder") from None
        yield


def parquet_of(manifest: Manifest, rows: Sequence[Row], mark: bytes) -> bytes:
    """Return rows as a Parquet file that carries a mark: of what study and block it is."""
    arrow = arrow_module()
    columns: dict[str, Any] = {
        "number": arrow.array([row.number for row in rows], arrow.int64()),
        "variant": arrow.array([row.variant for row in rows], arrow.string()),
        "scenario": arrow.array([row.scenario for row in rows], arrow.string()),
        "sample": arrow.array([row.sample for row in rows], arrow.int64()),
        "replicate": arrow.array([row.replicate for row in rows], arrow.int64()),
        "seed": arrow.array([row.seed for row in rows], arrow.int64()),
    }
    for column in manifest.varied:
        cells = [row.values.get(column.name) for row in rows]
        columns[column.name] = arrow.array(cells, arrow.float64())
    columns["status"] = arrow.array([row.status for row in rows], arrow.string())
    columns["message"] = arrow.array([row.message for row in rows], arrow.string())
    types = {
        "real": arrow.float64(), "whole": arrow.int64(), "list": arrow.list_(arrow.float64()),
    }  # fmt: skip
    for column in manifest.measures:
        measured = [row.measures[column.name] for row in rows]
        columns[column.name] = arrow.array(measured, types[column.type])
    units = {column.name: column.unit for column in (*manifest.varied, *manifest.measures)}
    kept = {b"modewright": mark, b"units": json.dumps(units).encode()}
    sink = arrow.BufferOutputStream()
    table = arrow.table(columns, metadata=kept)
    arrow.parquet.write_table(table, sink, compression="zstd")
    data: bytes = sink.getvalue().to_pybytes()
    return data


def _json(manifest: Manifest) -> bytes:
    shown = manifest.presentation
    data = {
        "modewright": FORMAT,
        "study": manifest.study,
        "digest": manifest.digest,
        "count": manifest.count,
        "block": manifest.block,
        "identity": dict(sorted(manifest.identity.items())),
        "varied": [vars(column) for column in manifest.varied],
        "words": {name: list(words) for name, words in manifest.words.items()},
        "measures": [vars(column) for column in manifest.measures],
        "presentation": {
            "by": list(shown.by), "confidence": shown.confidence, "plots": dict(shown.plots),
        },
    }  # fmt: skip
    return (json.dumps(data, indent=1) + "\n").encode()


def read_manifest(folder: Path) -> Manifest:
    """Return what the store in a folder is of. Raises SpecError."""
    path = folder / MANIFEST
    try:
        data = json.loads(path.read_text("utf-8"))
        if data["modewright"] != FORMAT:
            label = "these results are in a form that is not known here"
            raise _refused(folder, "store", label, "run the study into another folder")
        shown = data["presentation"]
        return Manifest(
            study=data["study"],
            digest=data["digest"],
            identity=data["identity"],
            count=data["count"],
            block=data["block"],
            varied=tuple(Column(**column) for column in data["varied"]),
            words=data["words"],
            measures=tuple(Column(**column) for column in data["measures"]),
            presentation=Presentation(tuple(shown["by"]), shown["confidence"], shown["plots"]),
        )
    except FileNotFoundError:
        label = "there are no results of a study here"
        raise _refused(folder, "store", label, "modewright sweep STUDY --out DIR") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        label = f"`{MANIFEST}` cannot be read: {error}"
        raise _refused(folder, "store", label) from None


def _another(folder: Path, there: Manifest, wanted: Manifest) -> SpecError:
    """Say which parts of the study are not those that the results are of."""
    names = dict.fromkeys([*there.identity, *wanted.identity])
    other = [n for n in names if there.identity.get(n) != wanted.identity.get(n)]
    parts = f"{', '.join(other[:3])}{' ...' if len(other) > 3 else ''}"
    label = f"the results here are of another state of `{there.study}`: {parts} changed"
    return _refused(folder, "store", label, "name another folder with --out, or undo the change")


def _refused(folder: Path, kind: str, label: str, help: str = "") -> SpecError:
    problems = Problems()
    problems.error(kind, Span(Source(str(folder)), 1, 1), label, help)
    return SpecError(problems.found)


def arrow_module() -> ModuleType:
    """Return pyarrow with its Parquet. Raises ToolMissing."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ToolMissing(
            "a study needs the package `pyarrow`: pip install 'modewright[parquet]'"
        ) from None
    found: ModuleType = pyarrow
    return found
