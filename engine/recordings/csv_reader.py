"""CSV reader: reads a text table with a head line, also gzipped, with the place of every cell."""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import math
import re
import zlib
from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path

from engine.recordings.frame_table import find_frame_table
from engine.recordings.recording_file import (
    MAX_BYTES,
    MAX_PROBLEMS,
    Assumption,
    RecordedFile,
    Samples,
)
from engine.recordings.text_dialect import (
    COMMA_NUMBER,
    COMMENT_MARKS,
    DECIMAL,
    MAX_PLAIN_LINE,
    MISSING_WORDS,
    SEPARATOR_NAMES,
    Dialect,
    detect_dialect,
    is_comment,
)
from language.expressions.unit_spellings import unit_meanings
from language.model.system import RecordingMap
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problems, Source, Span

DECIMAL_BYTES = b"+-.0123456789"
"""Characters of most numbers: a text of these alone that `float` accepts is a number."""
FORTRAN_EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)", re.ASCII)
"""Pattern of the letter of an exponent that Fortran writes."""
NAME_WITH_UNIT = re.compile(r".*\S ?(?:\[([^\[\]]+)\]|\(([^()]+)\))")
"""Pattern of a name with its unit in brackets, such as `T [degC]`."""
MAX_NOTED = 5
"""Largest number of texts in brackets that are noted."""
TEXT_HINT = "a recording is CSV, or CSV.gz"


def read_csv(path: Path, mapping: RecordingMap, problems: Problems) -> RecordedFile:
    """Read a text table, gzipped if its suffix is `.gz`.

    The map may state the format (`csv`); what it does not state is detected (`detect_dialect`) and
    returned as assumptions. Blank lines, rows without a cell that is not blank, and comments are
    skipped, and so is a last line that is too short and has no end of line. Other rows whose length
    differs from the head line are reported and left out; reading of rows stops after
    `MAX_PROBLEMS` problems. Cells that are no decimal numbers are NaN; empty cells and
    words for a missing value are None. Raises SpecError if the file cannot be read or unpacked, is
    no text, is empty or larger than `MAX_BYTES`, or if its numbers have two meanings.
    """
    source = Source(display_path(path))
    notes: list[Assumption] = []
    text = _read_text(path, source, mapping.text_format.encoding, notes)
    source = Source(source.name, tuple(text.splitlines()))
    wanted = {mapping.time} if mapping.time else set()
    for column in mapping.columns.values():
        wanted.update(column.columns, [column.time] if column.time else [])
    dialect = detect_dialect(source, mapping.text_format, wanted, notes)
    rows = _CsvRows(source, dialect, problems, is_cut=not text.endswith(("\n", "\r")))
    return RecordedFile(
        source,
        "column",
        rows.head,
        rows.samples,
        len(rows.rows),
        explain_missing=rows.explain_missing,
        head_line=dialect.head,
        assumptions=(*dialect.assumptions, *rows.notes),
    )


def _read_text(path: Path, source: Source, encoding: str, notes: list[Assumption]) -> str:
    """Return the text of a CSV or gzipped CSV file; what was assumed is added to `notes`.

    Raises SpecError.
    """
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
        text = _decode(data, encoding, notes)
    except OSError as error:
        reason = error.strerror or str(error)
        problems.error("unreadable", place, f"the recording cannot be read: {reason}")
    except (zlib.error, EOFError) as error:
        problems.error("unreadable", place, f"the recording cannot be unpacked: {error}")
    except UnicodeDecodeError as error:
        label = "this is not a text file"
        if encoding:
            label = f"the text is not in the encoding `{encoding}`: {error.reason}"
        problems.error("binary", place, label, TEXT_HINT)
    problems.raise_if_errors()
    stripped = text.rstrip("\0")
    if len(stripped) < len(text):
        count = len(text) - len(stripped)
        notes.append(Assumption("end of the text", f"{count} zero characters left out", "padding"))
    if not stripped.strip() and not text.strip("\0").strip():
        problems.error("empty", place, "the recording is empty")
    elif "\0" in stripped or _has_control_characters(stripped):
        problems.error("binary", place, "this is not a text file", TEXT_HINT)
    problems.raise_if_errors()
    return stripped


def _decode(data: bytes, encoding: str, notes: list[Assumption]) -> str:
    """Return the text of bytes: in the stated encoding, else UTF-16 by its mark, UTF-8 or cp1252.

    Raises UnicodeDecodeError.
    """
    if encoding:
        return data.decode(encoding).removeprefix("\N{ZERO WIDTH NO-BREAK SPACE}")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = data.decode("utf-16")
        notes.append(Assumption("encoding", "UTF-16", "the first two bytes"))
        return text
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252")
        notes.append(Assumption("encoding", "cp1252", "the bytes are no UTF-8"))
        return text


def _has_control_characters(text: str) -> bool:
    """Return whether the first characters contain control characters, as binary files do."""
    return any(ord(c) < 32 and c not in "\t\n\r\f\v" for c in text[:2000])


class _CsvRows:
    """Cells of a text table with their places."""

    def __init__(
        self, source: Source, dialect: Dialect, problems: Problems, is_cut: bool = False
    ) -> None:
        """Split the lines of a source; `is_cut` tells that the last line has no end."""
        self.source = source
        self.is_cut = is_cut
        self.dialect = dialect
        self.separator = dialect.separator
        self.head = list(dialect.names)
        self.numbers: list[int] = []
        self.rows: list[list[str]] = []
        self.notes: list[Assumption] = []
        self.blank = " \t\r" + self.separator
        self.units = self._units()
        if len(problems.reported) >= MAX_PROBLEMS or not self._split_all_rows():
            self._parse_each_row(problems)

    def _units(self) -> list[str]:
        """Return the unit of each column: of the line of units, else in brackets in its name.

        A text in brackets that is no known unit belongs to the name, which is noted.
        """
        if self.dialect.units:
            return [*self.dialect.units, *[""] * len(self.head)][: len(self.head)]
        found = [NAME_WITH_UNIT.fullmatch(name) for name in self.head]
        texts = [(match[1] or match[2] or "").strip() if match else "" for match in found]
        unknown = [text for text in texts if text and not unit_meanings(text)]
        if unknown:
            value = ", ".join(f"`{text}`" for text in dict.fromkeys(unknown[:MAX_NOTED]))
            reason = "no known unit: a part of the name"
            self.notes.append(Assumption("brackets in names", value, reason))
        return [text if unit_meanings(text) and not text.isdigit() else "" for text in texts]

    def explain_missing(self, name: str) -> str:
        """Return the name with its unit in brackets, or what the head line shows."""
        for written in self.head:
            match = NAME_WITH_UNIT.fullmatch(written)
            if match and written.startswith(name) and written[len(name) :].lstrip()[:1] in "[(":
                return f"did you mean `{written}`?"
        if find_frame_table(self.source.lines):
            return "the rows are CAN frames: `dbc: vehicle.dbc` in the map decodes them"
        if len(self.head) == 1:
            return "the cells are divided by a comma, semicolon, tab or bar"
        return ""

    def _line_numbers(self) -> list[int]:
        """Return the numbers of the lines with values; blank lines and comments are left out."""
        lines, first, blank = self.source.lines, self.dialect.first, self.blank
        numbers = [
            number
            for number, line in enumerate(lines[first - 1 :], start=first)
            if line.strip(blank)
        ]
        empty = sum(bool(line.strip()) for line in lines[first - 1 :]) - len(numbers)
        if empty:
            self.notes.append(Assumption("rows", f"{empty} left out", "all their cells are blank"))
        marked = [n for n in numbers if lines[n - 1].lstrip().startswith(COMMENT_MARKS)]
        comments = {n for n in marked if is_comment(lines[n - 1], self.separator)}
        if comments:
            value = f"{len(comments)} below the head line left out"
            self.notes.append(Assumption("comments", value, "they begin with # or //"))
        return [n for n in numbers if n not in comments] if comments else numbers

    def _split_all_rows(self) -> bool:
        """Split all lines at the separator.

        Return False if quotes, long lines or unequal rows prevent it.
        """
        lines = self.source.lines
        if '"' in "".join(lines) or max(map(len, lines)) >= MAX_PLAIN_LINE:
            return False
        notes = list(self.notes)
        numbers = self._line_numbers()
        rows = [lines[number - 1].split(self.separator) for number in numbers]
        if any(len(row) != len(self.head) for row in rows):
            self.notes = notes
            return False
        self.numbers, self.rows = numbers, rows
        return True

    def _parse_each_row(self, problems: Problems) -> None:
        """Parse line by line and report rows whose length differs from the head line.

        A blank cell that a row has more or less than the head line at its end does not count.
        """
        width, trailing = len(self.head), 0
        for number in self._line_numbers():
            line = self.source.lines[number - 1]
            row = self._parse_row(number, line, problems)
            if len(row) == width + 1 and not row[-1].strip():
                row.pop()
                trailing += 1
            elif len(row) == width - 1 and not self.head[-1]:
                row.append("")
            if self.is_cut and number == len(self.source.lines) and len(row) < width and self.rows:
                value = f"line {number} left out"
                self.notes.append(Assumption("last line", value, "it is cut off"))
            elif len(row) != width:
                label = f"this row has {len(row)} cells, the head line has {width}"
                name = SEPARATOR_NAMES[self.separator]
                hint = f"the cells of this file are divided by the {name}"
                hint += "; `csv: {head: N, separator: ...}` in the map states the form"
                problems.error("row", Span(self.source, number, 1, len(line)), label, hint)
            else:
                self.numbers.append(number)
                self.rows.append(row)
            if len(problems.reported) >= MAX_PROBLEMS:
                break
        if trailing:
            value = f"one blank cell left out in {trailing} rows"
            self.notes.append(Assumption("rows", value, "the separator ends the line"))

    def _parse_row(self, number: int, line: str, problems: Problems) -> list[str]:
        """Return the cells of a line; a malformed line is reported and gives empty cells."""
        if '"' not in line and len(line) < MAX_PLAIN_LINE:
            return line.split(self.separator)
        try:
            return next(csv.reader([line], delimiter=self.separator, strict=True))
        except csv.Error as error:
            label = f"not CSV: {error}"
            hint = ""
            if str(error) == "unexpected end of data":
                label = "a quotation mark of this line has no partner"
                hint = "a cell with line breaks is not read"
            problems.error("row", Span(self.source, number, 1, len(line)), label, hint)
            return [""] * len(self.head)

    @cached_property
    def columns(self) -> list[tuple[str, ...]]:
        """Cells of each column, in the order of the head line."""
        return list(zip(*self.rows, strict=True)) or [()] * len(self.head)

    def samples(self, name: str) -> Samples:
        """Return the samples of the first column of a name."""
        position = self.head.index(name)
        texts = list(map(str.strip, self.columns[position]))
        if self.dialect.decimal == ",":
            numbers = [_parse_comma_number(text) for text in texts]
            texts = [t.replace(",", ".") if COMMA_NUMBER.fullmatch(t) else t for t in texts]
        else:
            numbers = _parse_numbers(texts)

        def place(k: int) -> Span:
            line, row = self.numbers[k], self.rows[k]
            column = 1 + sum(len(cell) + 1 for cell in row[:position])
            return Span(self.source, line, column, max(1, len(row[position])))

        return Samples(numbers, texts.__getitem__, place, unit=self.units[position])


def _parse_numbers(texts: Sequence[str]) -> list[float | None]:
    """Return the number of each cell; None for an empty cell, NaN for any other text."""
    with suppress(ValueError):
        if not "".join(texts).encode().translate(None, DECIMAL_BYTES):
            return list(map(float, texts))
    return [_parse_number(text) for text in texts]


def _parse_number(text: str) -> float | None:
    """Return the number of a cell; None for a missing value, NaN for any other text.

    The letter D of an exponent and the minus sign of typography are accepted.
    """
    if not text or text.casefold() in MISSING_WORDS:
        return None
    if DECIMAL.fullmatch(text):
        return float(text)
    text = FORTRAN_EXPONENT.sub("e", text.replace("\N{MINUS SIGN}", "-"))
    return float(text) if DECIMAL.fullmatch(text) else math.nan


def _parse_comma_number(text: str) -> float | None:
    """Return the number of a cell with a decimal comma; NaN for a decimal point."""
    if "." in text and DECIMAL.fullmatch(text):
        return math.nan
    return _parse_number(text.replace(",", ".") if COMMA_NUMBER.fullmatch(text) else text)
