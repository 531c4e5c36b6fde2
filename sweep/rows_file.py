"""Rows file: rows of a block as the bytes of a Parquet file, which carries a digest of itself."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from types import ModuleType
from typing import Any, Literal

from engine.arrow import arrow_for
from sweep.block import Block, Row
from sweep.manifest import TYPES, Manifest

Fault = Literal["", "damaged", "another"]
"""What is wrong with a file: nothing; its bytes are not those written; it is of another study."""
TAG = b"sha256:"
NO_DIGEST = b"0" * hashlib.sha256().digest_size * 2
"""What stands for the digest of a file, in its metadata, while that is made."""


def block_file(manifest: Manifest, block: Block, rows: Sequence[Row]) -> bytes:
    """Return the rows of a block as the file that the store keeps of it."""
    return parquet_of(manifest, rows, mark_of(manifest, block))


def mark_of(manifest: Manifest, block: Block) -> bytes:
    """Return what the file of a block carries: of what study it is, and which block."""
    return f"{manifest.digest} {block.start}-{block.stop}".encode()


def fault_of(manifest: Manifest, block: Block, data: bytes) -> Fault:
    """Return what is wrong with the file of a block.

    The digest is looked at before pyarrow sees the file; one without it was not written here.
    """
    arrow = arrow_module()
    body, digest = _without_digest(data)
    if hashlib.sha256(body).hexdigest().encode() != digest:
        return "damaged"
    try:
        file = arrow.parquet.ParquetFile(arrow.BufferReader(data))
        kept, schema = file.metadata, file.schema_arrow
    except (OSError, ValueError, arrow.ArrowException):
        return "damaged"
    mark = (kept.metadata or {}).get(b"modewright", b"")
    if mark.split(b" ")[0] != manifest.digest.encode():
        return "another"
    fine = mark == mark_of(manifest, block) and kept.num_rows == block.stop - block.start
    return "" if fine and schema.equals(_schema(manifest)) else "damaged"


def parquet_of(manifest: Manifest, rows: Sequence[Row], mark: bytes) -> bytes:
    """Return rows as a Parquet file that carries a mark: of what study and block it is."""
    arrow = arrow_module()
    columns: dict[str, list[Any]] = {
        name: [getattr(row, name) for row in rows] for name in (*PLACE, *END)
    }
    for column in manifest.varied:
        columns[column.name] = [row.values.get(column.name) for row in rows]
    for column in manifest.measures:
        columns[column.name] = [row.measures[column.name] for row in rows]
    units = {column.name: column.unit for column in (*manifest.varied, *manifest.measures)}
    kept = {b"modewright": mark, b"units": json.dumps(units).encode()}
    schema = _schema(manifest).with_metadata(kept)
    arrays = [arrow.array(columns[field.name], field.type) for field in schema]
    sink = arrow.BufferOutputStream()
    with arrow.parquet.ParquetWriter(sink, schema, compression="zstd") as writer:
        writer.write_table(arrow.table(arrays, schema=schema))
        writer.add_key_value_metadata({b"digest": TAG + NO_DIGEST})
    data: bytes = sink.getvalue().to_pybytes()
    first = data.rfind(TAG) + len(TAG)
    digest = hashlib.sha256(data).hexdigest().encode()
    return data[:first] + digest + data[first + len(digest) :]


PLACE = {
    "number": "whole", "variant": "text", "scenario": "text", "sample": "whole",
    "replicate": "whole", "seed": "whole",
}  # fmt: skip
END = {"status": "text", "message": "text"}
"""The columns of every store, before and after what varies."""


def _schema(manifest: Manifest) -> Any:
    """Return the columns of a store in their order, with the types that pyarrow has for them."""
    arrow = arrow_module()
    kinds = {
        **PLACE, **{column.name: column.type for column in manifest.varied},
        **END, **{column.name: column.type for column in manifest.measures},
    }  # fmt: skip
    made = {
        kind: arrow.list_(arrow.float64()) if kind == "list" else getattr(arrow, name)()
        for kind, name in TYPES.items()
    }
    return arrow.schema([(name, made[kind]) for name, kind in kinds.items()])


def _without_digest(data: bytes) -> tuple[bytes, bytes]:
    """Return a file as it was when its digest was made, and that; empty: it has none."""
    place = data.rfind(TAG)
    first = place + len(TAG)
    last = first + len(NO_DIGEST)
    if place < 0 or last > len(data):
        return data, b""
    return data[:first] + NO_DIGEST + data[last:], data[first:last]


def arrow_module() -> ModuleType:
    """Return pyarrow with its Parquet. Raises ToolMissing."""
    return arrow_for("a study")
