"""Recorded Parquet: a table of numbers; places are rows, counted from 1."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from engine.arrow import arrow_for
from engine.recorded_file import RecordedFile, Samples, require_size, unreadable
from language.problem import Source, Span
from language.project import shown


def read_parquet(path: Path) -> RecordedFile:
    """Read a Parquet file. Raises SpecError, ToolMissing (no pyarrow)."""
    source = Source(shown(path))
    require_size(path, source)
    arrow = arrow_for("a Parquet file")
    try:
        table = arrow.parquet.read_table(path)
    except (OSError, arrow.ArrowException) as error:
        first = str(error).splitlines()[0]
        raise unreadable(source, f"understood as Parquet: {first}") from None

    def read(name: str) -> Samples:
        cells = table.column(name).to_pylist()

        def text(k: int) -> str:
            return "" if cells[k] is None else repr(cells[k])

        return Samples([_number(cell) for cell in cells], text, lambda k: Span(source, k + 1, 1))

    return RecordedFile(source, "column", table.column_names, read, table.num_rows)


def _number(cell: Any) -> float | None:
    if cell is None:
        return None
    return float(cell) if isinstance(cell, int | float) else math.nan
