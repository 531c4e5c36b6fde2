"""Text dialect: the encoding, separator, decimal sign and head line of a text recording.

What a map states holds. The rest follows from the names that the map reads and from the lines of
the file. Two possible readings are an error.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from engine.recordings.recording_file import Assumption
from engine.recordings.time_stamp import calendar_kind
from language.expressions.unit_spellings import unit_meanings
from language.model.system import TextFormat
from language.text.diagnostic import Problem, Source, Span, SpecError

DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
"""Pattern of a number; words such as `nan` and exponents of more than three digits do not match."""
COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d{1,3})?", re.ASCII)
"""Pattern of a number with a decimal comma, or of one with a comma of thousands."""
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""Pattern of a number whose comma may be a decimal sign or a sign of thousands."""
POINT_NUMBER = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d{1,3})?", re.ASCII)
"""Pattern of a number with a decimal point."""
MISSING_WORDS = frozenset(
    (
        *("nan", "-nan", "+nan", "#nan", "1.#qnan", "-1.#qnan", "1.#snan", "1.#ind", "-1.#ind"),
        *("#n/a", "#na", "n/a", "na", "<na>", "null", "(null)", "nil", "none", "-", "--", "---"),
    )
)
"""Texts in lower case that tools write for a value that is missing."""
SEPARATOR_NAMES = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar"}
"""Separators in the order in which they are preferred, with their words."""
SEPARATOR_LINE = re.compile(r'"?sep=(.|\\t|)"?', re.IGNORECASE)
"""Pattern of the first line with which spreadsheets state the separator."""
COMMENT_MARKS = ("#", "//")
"""Beginnings of lines of comment."""
MAX_PLAIN_LINE = 100_000
"""Length below which no cell exceeds the field limit of the csv module."""
SAMPLE_LINES = 200
"""Number of lines from which the head line and the separator follow."""


@dataclass(frozen=True)
class Dialect:
    """Form of a table of text: its separator, decimal sign, and lines, numbered from 1.

    `names` are the cells of the head line, `units` those of the line of units or empty. `first` is
    the number of the first line that can have values. `assumptions` tell what was not stated.
    """

    separator: str
    decimal: str
    head: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    first: int
    assumptions: tuple[Assumption, ...]


def detect_dialect(
    source: Source, stated: TextFormat, wanted: Collection[str], notes: Sequence[Assumption]
) -> Dialect:
    """Return the dialect of the lines of a text recording.

    `wanted` are the names of columns that the map reads: the line and the separator that give most
    of them are taken. Without one of them the head line is the last line of text above the values,
    and the separator the one that divides most lines alike. `notes` precede the assumptions. Raises
    SpecError if commas in numbers can be decimal signs or signs of thousands.
    """
    return _DialectSearch(source, stated, frozenset(wanted)).find(notes)


class _DialectSearch:
    """Search of the dialect of a text."""

    def __init__(self, source: Source, stated: TextFormat, wanted: frozenset[str]) -> None:
        self.source = source
        self.stated = stated
        self.wanted = wanted
        self.notes: list[Assumption] = []
        self.start = 1
        self.announced = ""

    def find(self, notes: Sequence[Assumption]) -> Dialect:
        """Return the dialect; see `detect_dialect`."""
        self.notes += notes
        self._read_separator_line()
        sample = list(self._numbered_lines())
        separator, head = self._find_separator_and_head(sample)
        line = self.source.lines[head - 1]
        head_comment = line.lstrip().startswith(COMMENT_MARKS) and not _is_plain(line, separator)
        names = split_row(line.lstrip("#/ ") if head_comment else line, separator)
        names = [name.strip() for name in names]
        units_line, units = self._find_units(sample, separator, head, len(names))
        first = max(head, units_line) + 1
        self._note_lines(separator, head, units_line)
        decimal = self._find_decimal(separator, first)
        return Dialect(
            separator, decimal, head, tuple(names), tuple(units), first, tuple(self.notes)
        )

    def _read_separator_line(self) -> None:
        """Read a first line `sep=;`."""
        match = SEPARATOR_LINE.fullmatch(self.source.lines[0].strip(" "))
        if match is None:
            return
        self.start = 2
        text = match[1].replace("\\t", "\t") or "\t"
        self.announced = text if text in SEPARATOR_NAMES else ""

    def _numbered_lines(self) -> Iterator[tuple[int, str]]:
        """Yield the first SAMPLE_LINES lines that are not blank, with their numbers."""
        count = 0
        for number in range(self.start, len(self.source.lines) + 1):
            line = self.source.lines[number - 1]
            if line.strip():
                yield number, line
                count += 1
                if count >= max(SAMPLE_LINES, self.stated.units + 1, self.stated.head + 1):
                    return

    def _find_separator_and_head(self, sample: Sequence[tuple[int, str]]) -> tuple[str, int]:
        """Return the separator and the number of the head line; what was chosen is noted."""
        fixed = self.stated.separator or self.announced
        candidates = [fixed] if fixed else list(SEPARATOR_NAMES)
        rows = [(n, line) for n, line in sample if not self.stated.head or n == self.stated.head]
        rows = rows or list(sample[:1])
        best: tuple[int, str, int] = (0, "", 0)
        for separator in candidates:
            for number, line in rows:
                cells = {cell.strip() for cell in split_row(line.lstrip("#/ "), separator)}
                found = len(cells & self.wanted)
                if found > best[0]:
                    best = (found, separator, number)
        if best[0]:
            return best[1], best[2]
        separator = fixed or _most_regular_separator([line for _, line in sample])
        return separator, self.stated.head or _last_text_line(sample, separator)

    def _find_units(
        self, sample: Sequence[tuple[int, str]], separator: str, head: int, width: int
    ) -> tuple[int, list[str]]:
        """Return the number and the cells of the line of units; 0 and nothing without one."""
        if self.stated.units:
            line = self.source.lines[self.stated.units - 1 : self.stated.units]
            cells = split_row(line[0], separator) if line else []
            return self.stated.units, [cell.strip() for cell in cells]
        below = next(((n, line) for n, line in sample if n > head), None)
        if below is None or not is_unit_row(split_row(below[1], separator), width):
            return 0, []
        return below[0], [cell.strip() for cell in split_row(below[1], separator)]

    def _note_lines(self, separator: str, head: int, units_line: int) -> None:
        """Note the separator, skipped lines and the line of units, if they are not the usual."""
        if separator != "," and not self.stated.separator:
            where = "the first line says so" if self.announced else "it divides the lines alike"
            self.notes.append(Assumption("separator", SEPARATOR_NAMES[separator], where))
        above = sum(bool(line.strip()) for line in self.source.lines[self.start - 1 : head - 1])
        if above and not self.stated.head:
            value = f"line {head}, {above} above it skipped"
            self.notes.append(Assumption("head line", value, "it has the names of the columns"))
        if units_line and not self.stated.units:
            value = f"line {units_line}"
            self.notes.append(Assumption("units", value, "below the names, no numbers"))

    def _find_decimal(self, separator: str, first: int) -> str:
        """Return the decimal sign. Raises SpecError if both readings are possible."""
        if self.stated.decimal:
            return self.stated.decimal
        doubtful: tuple[int, str] | None = None
        has_points = False
        lines = self.source.lines
        if separator == "," and '"' not in "".join(lines):
            return "."
        for number in range(first, len(lines) + 1):
            line = lines[number - 1]
            has_commas = "," in line and (separator != "," or '"' in line)
            if not has_commas and (has_points or "." not in line):
                continue
            for cell in map(str.strip, split_row(line, separator)):
                if COMMA_NUMBER.fullmatch(cell):
                    if not THOUSANDS.fullmatch(cell):
                        reason = f"`{cell}` in line {number}"
                        self.notes.append(Assumption("decimal sign", "comma", reason))
                        return ","
                    doubtful = doubtful or (number, cell)
                elif POINT_NUMBER.fullmatch(cell):
                    has_points = True
        if doubtful and not has_points:
            label = f"`{doubtful[1]}` has two meanings: a decimal comma or a comma of thousands"
            help = "`csv: {decimal: comma}` in the map, or `decimal: point`"
            raise SpecError([Problem("value", Span(self.source, doubtful[0], 1), label, help)])
        return "."


def split_row(line: str, separator: str) -> list[str]:
    """Return the cells of a line; a malformed quoted line is split at each separator."""
    if '"' in line and len(line) < MAX_PLAIN_LINE:
        try:
            return next(csv.reader([line], delimiter=separator, strict=True))
        except (csv.Error, StopIteration):
            pass
    return line.split(separator)


def is_value(cell: str) -> bool:
    """Return whether a cell is a number, a time stamp or a word for a missing value."""
    text = cell.strip()
    return _is_number_or_time(text) or text.casefold() in MISSING_WORDS


def _is_number_or_time(text: str) -> bool:
    """Return whether a text is a number or a time stamp."""
    return bool(DECIMAL.fullmatch(text) or COMMA_NUMBER.fullmatch(text) or calendar_kind(text))


def is_unit_row(row: Sequence[str], width: int) -> bool:
    """Return whether a row below the names has units: no numbers, and a unit that is understood.

    `width` is the number of names. A row without a text has no units, and one with `-` for each
    value has none.
    """
    cells = [cell.strip() for cell in row]
    texts = [cell for cell in cells if cell]
    if not texts or abs(len(cells) - width) > 1 or any(map(_is_number_or_time, texts)):
        return False
    return any(unit_meanings(text) for text in texts if text.casefold() not in MISSING_WORDS)


def _is_plain(line: str, separator: str) -> bool:
    """Return whether a line begins with the cell `#`, which is a name and no comment."""
    return line.lstrip().partition(separator)[0].strip() in COMMENT_MARKS


def is_comment(line: str, separator: str) -> bool:
    """Return whether a line is a comment."""
    return line.lstrip().startswith(COMMENT_MARKS) and not _is_plain(line, separator)


def _most_regular_separator(lines: Sequence[str]) -> str:
    """Return the separator that divides the largest part of the lines alike into several cells."""
    best = (0, ",")
    for separator in SEPARATOR_NAMES:
        widths = Counter(len(split_row(line, separator)) for line in lines)
        alike = max((count for width, count in widths.items() if width > 1), default=0)
        if alike > best[0]:
            best = (alike, separator)
    return best[1]


def _last_text_line(sample: Sequence[tuple[int, str]], separator: str) -> int:
    """Return the number of the line of names: the last line of text above the first values.

    A line of units does not count. Without values, and if the first line has values, it is the
    first line that is no comment.
    """
    plain = [(number, line) for number, line in sample if not is_comment(line, separator)]
    if not plain:
        return sample[0][0]
    rows = [split_row(line, separator) for _, line in plain]
    first = next((k for k, row in enumerate(rows) if _has_values(row)), 0)
    if first == 0:
        above = [number for number, _ in sample if number < plain[0][0]]
        is_headless = _has_values(rows[0]) and above
        comment = dict(sample)[above[-1]] if is_headless else ""
        if comment and len(split_row(comment, separator)) == len(rows[0]) > 1:
            return above[-1]
        return plain[0][0]
    if first > 1 and len(rows[first - 2]) == len(rows[first - 1]):
        follows = plain[first - 1][0] == plain[first - 2][0] + 1
        if follows and is_unit_row(rows[first - 1], len(rows[first - 2])):
            return plain[first - 2][0]
    return plain[first - 1][0]


def _has_values(row: Sequence[str]) -> bool:
    """Return whether at least half of the cells with a text are values."""
    texts = [cell for cell in row if cell.strip()]
    return bool(texts) and 2 * sum(map(is_value, texts)) >= len(texts)
