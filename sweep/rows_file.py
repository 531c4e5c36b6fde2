"""Rows file: rows of a block as the bytes of a Parquet file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from types import ModuleType
from typing import Any

from engine.arrow import arrow_for
from sweep.block import Block, Row
from sweep.manifest import Manifest


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
    arrow.parquet.write_table(table, sink, compression="zstd")
    data: bytes = sink.getvalue().to_pybytes()
    return data


def arrow_module() -> ModuleType:
    """Return pyarrow with its Parquet. Raises ToolMissing."""
    return arrow_for("a study")
