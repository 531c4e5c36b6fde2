"""Parquet reader: reads a table of numbers; the place of a value is its row, counted from 1."""

from __future__ import annotations

import math
from datetime import date
from decimal import Decimal
from pathlib import Path
from typing import Any

from engine.recordings.recording_file import (
    Assumption,
    RecordedFile,
    Samples,
    require_size,
    unreadable_error,
)
from engine.recordings.text_dialect import DECIMAL, MISSING_WORDS
from engine.results.pyarrow_import import import_pyarrow
from language.overlays.expand_document import display_path
from language.text.diagnostic import Source, Span


def read_parquet(path: Path) -> RecordedFile:
    """Read a Parquet file; columns are read on demand.

    Null cells, NaN and words for missing values are None, other cells that are no numbers NaN.
    Dates have the form of ISO 8601. Raises SpecError if the file cannot be read or understood, is
    empty or too large, and MissingToolError without pyarrow.
    """
    source = Source(display_path(path))
    require_size(path, source)
    arrow = import_pyarrow("a Parquet file")
    try:
        table = arrow.parquet.read_table(path)
    except (OSError, arrow.ArrowException) as error:
        first = str(error).splitlines()[0]
        raise unreadable_error(source, f"understood as Parquet: {first}") from None

    def read(name: str) -> Samples:
        cells = table.column(name).to_pylist()

        def text(k: int) -> str:
            return _to_text(cells[k])

        def place(k: int) -> Span:
            return Span(source, k + 1, 1)

        values = [_to_float(cell) for cell in cells]
        count = sum(
            isinstance(cell, str) and value is not None and math.isfinite(value)
            for cell, value in zip(cells, values, strict=True)
        )
        note = Assumption(f"column `{name}`", f"{count} numbers", "the table has them as texts")
        return Samples(values, text, place, assumptions=(note,) if count else ())

    return RecordedFile(source, "column", table.column_names, read, table.num_rows)


def _to_text(cell: Any) -> str:
    """Return the text of a cell: empty for null, a date in ISO 8601, else that of a CSV file."""
    if cell is None:
        return ""
    if isinstance(cell, date):
        return cell.isoformat()
    return str(cell) if isinstance(cell, str | Decimal) else repr(cell)


def _to_float(cell: Any) -> float | None:
    """Return a cell as float; None for a missing value, also NaN; NaN for a cell of another type.

    A text counts as missing if it is blank or a word for a missing value (`MISSING_WORDS`). Another
    text is the number that it writes with a decimal point.
    """
    if isinstance(cell, str):
        written = cell.strip()
        if not written or written.casefold() in MISSING_WORDS:
            return None
        return float(written) if DECIMAL.fullmatch(written) else math.nan
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return None
    return float(cell) if isinstance(cell, int | float | Decimal) else math.nan
