"""CSV reader: reads a text table with a header line, also gzipped, with the place of every cell."""

from __future__ import annotations

import csv
import gzip
import io
import math
import re
import zlib
from contextlib import suppress
from functools import cached_property
from pathlib import Path

from engine.recordings.recording_file import MAX_BYTES, MAX_PROBLEMS, RecordedFile, Samples
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problems, Source, Span

DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
"""Pattern of a number; words such as `nan` and exponents of more than three digits do not match."""

DECIMAL_BYTES = b"+-.0123456789"
"""Characters of most numbers: a text of these alone that `float` accepts is a number."""
MAX_PLAIN_LINE = 100_000
"""Length below which no cell exceeds the field limit of the csv module."""


def read_csv(path: Path, problems: Problems) -> RecordedFile:
    """Read a CSV file in UTF-8, gzipped if its suffix is `.gz`.

    Cells are separated by commas; the first line that is not blank is the header, blank lines are
    skipped. Rows whose length differs from the header are reported and left out; reading of rows
    stops after `MAX_PROBLEMS` problems. Cells that are no decimal numbers are NaN, empty cells
    None. Raises SpecError if the file cannot be read or unpacked, is no text, is empty or is larger
    than `MAX_BYTES`.
    """
    source = Source(display_path(path))
    lines = _read_lines(path, source)
    source = Source(source.name, tuple(lines))
    rows = _CsvRows(source, problems)
    return RecordedFile(source, "column", rows.head, rows.samples, len(rows.rows))


def _read_lines(path: Path, source: Source) -> list[str]:
    """Return the lines of a CSV or gzipped CSV file. Raises SpecError."""
    problems = Problems()
    place = Span(source, 1, 1)
    text = ""
    try:
        if path.stat().st_size > MAX_BYTES:
            problems.error("huge", place, f"the recording is larger than {MAX_BYTES} bytes")
            problems.raise_if_errors()
        data = path.read_bytes()
        if path.suffix == ".gz":
            data = gzip.GzipFile(fileobj=io.BytesIO(data)).read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            problems.error("huge", place, f"the recording is larger than {MAX_BYTES} bytes")
            problems.raise_if_errors()
        text = data.decode("utf-8-sig")
    except OSError as error:
        reason = error.strerror or str(error)
        problems.error("unreadable", place, f"the recording cannot be read: {reason}")
    except (zlib.error, EOFError) as error:
        problems.error("unreadable", place, f"the recording cannot be unpacked: {error}")
    except UnicodeDecodeError:
        problems.error("binary", place, "this is not a text file", "a recording is CSV, or CSV.gz")
    problems.raise_if_errors()
    if "\0" in text:
        problems.error("binary", place, "this is not a text file", "a recording is CSV, or CSV.gz")
    elif not text.strip():
        problems.error("empty", place, "the recording is empty")
    problems.raise_if_errors()
    return text.splitlines()


class _CsvRows:
    """Cells of a CSV text with their places."""

    def __init__(self, source: Source, problems: Problems) -> None:
        self.source = source
        self.head: list[str] = []
        self.numbers: list[int] = []
        self.rows: list[list[str]] = []
        if len(problems.reported) >= MAX_PROBLEMS or not self._split_all_rows():
            self._parse_each_row(problems)

    def _split_all_rows(self) -> bool:
        """Split all lines at commas.

        Return False if quotes, long lines or unequal rows prevent it.
        """
        lines = self.source.lines
        if '"' in "".join(lines) or max(map(len, lines)) >= MAX_PLAIN_LINE:
            return False
        numbers = [number for number, line in enumerate(lines, start=1) if line.strip()]
        rows = [lines[number - 1].split(",") for number in numbers]
        if len(set(map(len, rows))) > 1:
            return False
        self.head = [cell.strip() for cell in rows[0]]
        self.numbers, self.rows = numbers[1:], rows[1:]
        return True

    def _parse_each_row(self, problems: Problems) -> None:
        """Parse line by line and report rows whose length differs from the header."""
        for number, line in enumerate(self.source.lines, start=1):
            if not line.strip():
                continue
            row = self._parse_row(number, line, problems)
            if not self.head:
                self.head = [cell.strip() for cell in row]
            elif len(row) != len(self.head):
                label = f"this row has {len(row)} cells, the head line has {len(self.head)}"
                hint = "a recording is separated by commas, with decimal points"
                problems.error("row", Span(self.source, number, 1, len(line)), label, hint)
            else:
                self.numbers.append(number)
                self.rows.append(row)
            if len(problems.reported) >= MAX_PROBLEMS:
                break

    def _parse_row(self, number: int, line: str, problems: Problems) -> list[str]:
        """Return the cells of a line; a malformed line is reported and gives empty cells."""
        if '"' not in line and len(line) < MAX_PLAIN_LINE:
            return line.split(",")
        try:
            return next(csv.reader([line], strict=True))
        except csv.Error as error:
            problems.error("row", Span(self.source, number, 1, len(line)), f"not CSV: {error}")
            return [""] * len(self.head)

    @cached_property
    def columns(self) -> list[tuple[str, ...]]:
        """Cells of each column, in the order of the header."""
        return list(zip(*self.rows, strict=True)) or [()] * len(self.head)

    def samples(self, name: str) -> Samples:
        """Return the samples of the first column of a name."""
        position = self.head.index(name)
        texts = list(map(str.strip, self.columns[position]))

        def place(k: int) -> Span:
            line, row = self.numbers[k], self.rows[k]
            column = 1 + sum(len(cell) + 1 for cell in row[:position])
            return Span(self.source, line, column, max(1, len(row[position])))

        return Samples(_parse_numbers(texts), texts.__getitem__, place)


def _parse_numbers(texts: list[str]) -> list[float | None]:
    """Return the number of each cell; None for an empty cell, NaN for any other text."""
    with suppress(ValueError):
        if not "".join(texts).encode().translate(None, DECIMAL_BYTES):
            return list(map(float, texts))
    return [_parse_number(text) for text in texts]


def _parse_number(text: str) -> float | None:
    """Return the number of a cell; None for an empty cell, NaN for any other text."""
    if not text:
        return None
    return float(text) if DECIMAL.fullmatch(text) else math.nan
