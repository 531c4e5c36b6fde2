"""Rows file: rows of a block as the bytes of a Parquet file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from engine.arrow import arrow_for
from language.problem import SpecError
from language.text import shortened
from sweep.block import Block, Row
from sweep.manifest import Manifest, refused


def block_file(manifest: Manifest, block: Block, rows: Sequence[Row]) -> bytes:
    """Return the rows of a block as the file that the store keeps of it."""
    return parquet_of(manifest, rows, mark_of(manifest, block))


def mark_of(manifest: Manifest, block: Block) -> bytes:
    """Return what the file of a block carries: of what study it is, and which block."""
    return f"{manifest.digest} {block.start}-{block.stop}".encode()


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
        "real": arrow.float64(), "whole": arrow.int64(), "text": arrow.string(),
        "truth": arrow.bool_(),
        "list": arrow.list_(arrow.float64()),
    }  # fmt: skip
    for column in manifest.measures:
        measured = [row.measures[column.name] for row in rows]
        columns[column.name] = arrow.array(measured, types[column.type])
    units = {column.name: column.unit for column in (*manifest.varied, *manifest.measures)}
    kept = {b"modewright": mark, b"units": json.dumps(units).encode()}
    sink = arrow.BufferOutputStream()
    table = arrow.table(columns, metadata=kept)
    arrow.parquet.write_table(table, sink, compression="zstd", write_page_checksum=True)
    data: bytes = sink.getvalue().to_pybytes()
    return data


def columns_of_file(path: Path, names: Sequence[str] | None = None) -> Any:
    """Return columns of a block from its file. Raises SpecError where that is damaged.

    Pages carry checksums: without them most single bits that turn are read as other numbers.
    """
    arrow = arrow_module()
    try:
        with arrow.parquet.ParquetFile(path, page_checksum_verification=True) as file:
            found = file.read(columns=None if names is None else list(names))
    except (OSError, arrow.ArrowException) as error:
        raise _damaged(path, str(error).splitlines()[0]) from None
    if missing := [name for name in names or () if name not in found.column_names]:
        raise _damaged(path, f"it has no column `{missing[0]}`")
    return found


def _damaged(path: Path, why: str) -> SpecError:
    hint = "the same `modewright sweep STUDY --out DIR` removes it and computes it again"
    return refused(path, "store", f"the file of this block is damaged: {shortened(why)}", hint)


def arrow_module() -> ModuleType:
    """Return pyarrow with its Parquet. Raises ToolMissing."""
    return arrow_for("a study")
