"""Block file: encode the rows of a block as a Parquet file that contains its own digest."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from types import ModuleType
from typing import Any, Literal

from engine.results.pyarrow_import import import_pyarrow
from sweep.store.manifest import ARROW_TYPES, Manifest
from sweep.store.row import Block, Row

FileFault = Literal["", "damaged", "another"]
"""The fault of a file: none, changed bytes, or rows of another study."""
DIGEST_TAG = b"sha256:"
"""The text before the digest in the metadata of a file."""
DIGEST_PLACEHOLDER = b"0" * hashlib.sha256().digest_size * 2
"""The text in place of the digest while the digest is computed."""


def encode_block(manifest: Manifest, block: Block, rows: Sequence[Row]) -> bytes:
    """Return the rows of a block as the bytes of its file in the store.

    It is the file of `encode_parquet` with the mark `mark_of`. Raises MissingToolError.
    """
    return encode_parquet(manifest, rows, mark_of(manifest, block))


def mark_of(manifest: Manifest, block: Block) -> bytes:
    """Return the mark of a block's file: `<digest of the study> <start>-<stop>` in UTF-8."""
    return f"{manifest.digest} {block.start}-{block.stop}".encode()


def block_file_fault(manifest: Manifest, block: Block, data: bytes) -> FileFault:
    """Return the fault of the file of a block, given its contents.

    "" for none; "another" for a file of another study; else "damaged": no digest or a wrong one, no
    Parquet, another range of variants, number of rows or columns. The digest is checked before
    pyarrow parses the bytes. Raises MissingToolError.
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
    """Return rows as a Parquet file with a mark, the units of the columns and a digest.

    The columns are LEADING_COLUMNS, the variables (null without a value), STATUS_COLUMNS, the
    measures. The digest is the SHA-256 of the file with DIGEST_PLACEHOLDER in its place. Raises
    MissingToolError; KeyError if a row lacks a measure.
    """
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
"""The columns before the variables in each store, with types."""
STATUS_COLUMNS = {"status": "text", "message": "text"}
"""The columns between variables and measures in each store, with types."""


def _arrow_schema(manifest: Manifest) -> Any:
    """Return the schema of a store: leading columns, variables, status, measures."""
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
    """Return the file with the placeholder instead of its digest, and the digest.

    The digest is empty if the file has none.
    """
    place = data.rfind(DIGEST_TAG)
    first = place + len(DIGEST_TAG)
    last = first + len(DIGEST_PLACEHOLDER)
    if place < 0 or last > len(data):
        return data, b""
    return data[:first] + DIGEST_PLACEHOLDER + data[last:], data[first:last]


def import_arrow() -> ModuleType:
    """Return pyarrow with its Parquet module. Raises MissingToolError if it is not installed."""
    return import_pyarrow("a study")
