"""Rows file: rows of a block as the bytes of a Parquet file, which carries a digest of itself."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from types import ModuleType
from typing import Any, Literal

from engine.results.parquet import import_pyarrow
from sweep.store.manifest import ARROW_TYPES, Manifest
from sweep.store.row import Block, Row

FileFault = Literal["", "damaged", "another"]
"""What is wrong with a file: nothing; its bytes are not those written; it is of another study."""
DIGEST_TAG = b"sha256:"
DIGEST_PLACEHOLDER = b"0" * hashlib.sha256().digest_size * 2
"""What stands for the digest of a file, in its metadata, while that is made."""


def encode_block(manifest: Manifest, block: Block, rows: Sequence[Row]) -> bytes:
    """Return the rows of a block as the file that the store keeps of it."""
    return encode_parquet(manifest, rows, mark_of(manifest, block))


def mark_of(manifest: Manifest, block: Block) -> bytes:
    """Return what the file of a block carries: of what study it is, and which block."""
    return f"{manifest.digest} {block.start}-{block.stop}".encode()


def fault_of(manifest: Manifest, block: Block, data: bytes) -> FileFault:
    """Return what is wrong with the file of a block.

    The digest is looked at before pyarrow sees the file; one without it was not written here.
    """
    arrow = import_arrow()
    body, digest = _split_digest(data)
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
    return "" if fine and schema.equals(_arrow_schema(manifest)) else "damaged"


def encode_parquet(manifest: Manifest, rows: Sequence[Row], mark: bytes) -> bytes:
    """Return rows as a Parquet file that carries a mark: of what study and block it is."""
    arrow = import_arrow()
    columns: dict[str, list[Any]] = {
        name: [getattr(row, name) for row in rows] for name in (*LEADING_COLUMNS, *STATUS_COLUMNS)
    }
    for column in manifest.varied:
        columns[column.name] = [row.values.get(column.name) for row in rows]
    for column in manifest.measures:
        columns[column.name] = [row.measures[column.name] for row in rows]
    units = {column.name: column.unit for column in (*manifest.varied, *manifest.measures)}
    kept = {b"modewright": mark, b"units": json.dumps(units).encode()}
    schema = _arrow_schema(manifest).with_metadata(kept)
    arrays = [arrow.array(columns[field.name], field.type) for field in schema]
    sink = arrow.BufferOutputStream()
    with arrow.parquet.ParquetWriter(sink, schema, compression="zstd") as writer:
        writer.write_table(arrow.table(arrays, schema=schema))
        writer.add_key_value_metadata({b"digest": DIGEST_TAG + DIGEST_PLACEHOLDER})
    data: bytes = sink.getvalue().to_pybytes()
    first = data.rfind(DIGEST_TAG) + len(DIGEST_TAG)
    digest = hashlib.sha256(data).hexdigest().encode()
    return data[:first] + digest + data[first + len(digest) :]


LEADING_COLUMNS = {
    "number": "whole", "variant": "text", "scenario": "text", "sample": "whole",
    "replicate": "whole", "seed": "whole",
}  # fmt: skip
STATUS_COLUMNS = {"status": "text", "message": "text"}
"""The columns of every store, before and after what varies."""


def _arrow_schema(manifest: Manifest) -> Any:
    """Return the columns of a store in their order, with the types that pyarrow has for them."""
    arrow = import_arrow()
    kinds = {
        **LEADING_COLUMNS, **{column.name: column.type for column in manifest.varied},
        **STATUS_COLUMNS, **{column.name: column.type for column in manifest.measures},
    }  # fmt: skip
    made = {
        kind: arrow.list_(arrow.float64()) if kind == "list" else getattr(arrow, name)()
        for kind, name in ARROW_TYPES.items()
    }
    return arrow.schema([(name, made[kind]) for name, kind in kinds.items()])


def _split_digest(data: bytes) -> tuple[bytes, bytes]:
    """Return a file as it was when its digest was made, and that; empty: it has none."""
    place = data.rfind(DIGEST_TAG)
    first = place + len(DIGEST_TAG)
    last = first + len(DIGEST_PLACEHOLDER)
    if place < 0 or last > len(data):
        return data, b""
    return data[:first] + DIGEST_PLACEHOLDER + data[last:], data[first:last]


def import_arrow() -> ModuleType:
    """Return pyarrow with its Parquet. Raises ToolMissing."""
    return import_pyarrow("a study")
