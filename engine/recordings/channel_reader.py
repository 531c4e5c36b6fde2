"""Channel reader: converts the columns of a recorded file to SI values with exact time stamps.

A recording map names the columns, their units, scales and delays. The input is a `RecordedFile` of
any format, the output the samples of a `Channel`.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property

import numpy as np

from engine.recordings.recording_file import Assumption, RecordedFile, Samples
from engine.recordings.text_dialect import COMMA_NUMBER, DECIMAL
from engine.recordings.time_column import TimeColumnReader, report_unsorted
from language.expressions.unit_spellings import UNIT_EQUIVALENTS, normalise_unit_text, unit_meanings
from language.expressions.units import Unit, is_same_unit
from language.model.system import ColumnMapping, RecordingMap
from language.text.diagnostic import Problems, Span, suggest_name
from language.typecheck.types import MAX_INT, EnumType

DISCRETE_TOLERANCE = 1e-6
"""Largest distance of a value from a whole number that stands for it; scales leave roundings."""
MAX_NAMES = 6
"""Number of names of columns that a message lists."""
TRUTH_WORDS = {
    **dict.fromkeys(("true", "on", "yes"), 1.0),
    **dict.fromkeys(("false", "off", "no"), 0.0),
}
"""Numbers of words for truth values, in lower case."""


def require_names(
    file: RecordedFile, names: Sequence[str], mapping: RecordingMap, problems: Problems
) -> None:
    """Report each of `names` that a file lacks or has more than once, and a file without rows.

    Nothing is raised. The hint for a missing name is that of the file (`explain_missing`), else a
    similar name.
    """
    for name in dict.fromkeys(names):
        count = list(file.names).count(name)
        if not count:
            label = f"there is no {file.noun} `{name}`, which map `{mapping.name}` reads"
            hint = file.explain_missing(name) or suggest_name(name, file.names)
            hint = hint or _list_names(file)
            problems.error("column", file.header_span, label, hint)
        elif count > 1:
            label = f"there are {'two' if count == 2 else count} {file.noun}s `{name}`"
            hint = file.explain_ambiguous(name) or "rename one of them in the file"
            problems.error("column", file.header_span, label, hint)
    if not file.rows:
        label = "the recording has a head line and no values"
        if file.is_stamped:
            label = "the recording has no values"
        problems.error("empty", file.header_span, label)


def _list_names(file: RecordedFile) -> str:
    """Return the first names of a file (`MAX_NAMES`) as a hint; empty if it has none."""
    names = [f"`{name}`" for name in dict.fromkeys(file.names) if name]
    rest = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return f"the file has {', '.join(names[:MAX_NAMES])}{rest}" if names else ""


class ChannelReader:
    """Reader of channels of a file by a map, with exact time stamps."""

    def __init__(self, file: RecordedFile, mapping: RecordingMap, problems: Problems) -> None:
        """Read the time column that all rows share, if the format has one.

        Problems are reported.
        """
        self.file = file
        self.mapping = mapping
        self.problems = problems
        self.assumptions: list[Assumption] = []
        self.time_reader = TimeColumnReader(file, mapping, problems)
        self.clock = [] if file.is_stamped else self.time_reader.times(mapping.time)

    @cached_property
    def shared_times(self) -> tuple[Fraction, ...]:
        """Time stamps [s] that all columns share.

        They are empty if one is blank or invalid, and for a file whose channels have their own.
        """
        known = tuple(time for time in self.clock if time is not None)
        return known if len(known) == len(self.clock) else ()

    def _own_stamps(
        self, column: ColumnMapping, parts: Sequence[Samples]
    ) -> Sequence[Fraction | None]:
        """Return the time stamps [s] of the channels that a map column averages.

        Channels with different stamps, and stamps that do not increase, are reported.
        """
        stamps = parts[0].stamps or ()
        if any(part.stamps != stamps for part in parts[1:]):
            label = f"the {self.file.noun}s of `{column.name}` do not have the same time stamps"
            hint = "a mean is taken of values that were measured together"
            self.problems.error("time", column.span, label, hint)
        for k, (before, after) in enumerate(itertools.pairwise(stamps), start=1):
            if after <= before and not self.time_reader.has_max_problems:
                report_unsorted(repr(float(after)), after, before, parts[0].place(k), self.problems)
        return stamps

    def samples(self, column: ColumnMapping) -> tuple[tuple[Fraction, ...], tuple[float, ...]]:
        """Return the time stamps [s] and SI values of a column of the map, of equal length.

        Stamps are those of the file's channels (`is_stamped`), of the column's own time column, or
        the shared ones. Several columns of the file are averaged row by row, then multiplied by
        scale and sign; the delay is added to the stamps. Rows are skipped if one of the columns has
        no value or the stamp is missing. Reported are a blank stamp beside a value (own time
        column), values that are not finite (NaN cells are skipped, overflows kept), empty cells if
        the map refuses them, another unit in the file, and a column without values.
        """
        parts = [self.file.read(name) for name in column.columns]
        self.assumptions += [item for part in parts for item in part.assumptions]
        if self.file.is_stamped:
            stamps = self._own_stamps(column, parts)
        else:
            stamps = self.time_reader.times(column.time) if column.time else self.clock
        cells = [
            self._values(name, part, column)
            for name, part in zip(column.columns, parts, strict=True)
        ]
        times: list[Fraction] = []
        values_si: list[float] = []
        scale = float(column.scale[0]) * column.sign
        means = cells[0] if len(cells) == 1 else _row_means(cells)
        is_discrete = column.signal_type is not None and column.to is not None
        is_plain = not column.delay and not is_discrete
        if stamps is self.clock and len(self.shared_times) == len(means) > 0 and is_plain:
            values = _scale_all(means, scale)
            if values is not None:
                return self.shared_times, tuple(values)
        for k, (stamp, mean) in enumerate(zip(stamps, means, strict=False)):
            if mean is None:
                continue
            if stamp is None:
                if column.time and not self.file.read(column.time).text(k):
                    label = f"a value of `{column.name}` without a time stamp"
                    self.problems.error("time", parts[0].place(k), label)
                continue
            value = mean * scale
            if is_discrete and math.isfinite(value):
                value = self._to_discrete(column, value, parts[0].place(k))
            if not math.isfinite(value):
                place = parts[0].place(k)
                self.problems.error("value", place, f"`{column.name}` is {value} in SI")
            times.append(stamp + column.delay if column.delay else stamp)
            values_si.append(value)
        if not times and not self.problems.has_errors:
            label = f"{self.file.noun} `{column.columns[0]}` has no values"
            self.problems.error("empty", self.file.header_span, label)
        return tuple(times), tuple(values_si)

    def _values(self, name: str, samples: Samples, column: ColumnMapping) -> list[float | None]:
        """Return the values of a file column in SI; None for empty or invalid cells.

        Cells that are not finite numbers are reported, and empty cells if the map refuses them.
        """
        factor, offset = float(column.unit.factor), float(column.unit.offset)
        self._check_unit(name, samples.unit, column)
        values = self._numbers_of_words(samples, column)
        scaled = None if self.time_reader.has_max_problems else _scale_all(values, factor, offset)
        if scaled is not None:
            return [*scaled]
        result: list[float | None] = []
        for k, value in enumerate(values):
            if self.time_reader.has_max_problems:
                break
            if value is not None and not math.isfinite(value):
                value = self._number_of_word(samples.text(k), column)
                if value is None:
                    label, help = self._explain_value(name, samples.text(k), column)
                    self.problems.error("value", samples.place(k), label, help)
            elif value is None and column.blank == "refuse":
                label = f"{self.file.noun} `{name}` has no value here"
                hint = "`blank: skip` in the map leaves empty cells out"
                if samples.text(k):
                    label += f": `{samples.text(k)}`"
                self.problems.error("value", samples.place(k), label, hint)
            result.append(None if value is None else value * factor + offset)
        return result

    def _numbers_of_words(self, samples: Samples, column: ColumnMapping) -> Sequence[float | None]:
        """Return the values, or the numbers in the map's signal of the words of the file.

        The words count if the signal knows one of them; a word that it does not know is then NaN.
        """
        numbers = [self._number_of_word(word, column) for word in samples.words]
        if not any(number is not None for number in numbers):
            return samples.values
        return [
            number if number is not None else math.nan if word and value is not None else value
            for number, word, value in zip(numbers, samples.words, samples.values, strict=True)
        ]

    def _number_of_word(self, text: str, column: ColumnMapping) -> float | None:
        """Return the number of a truth word or of a name of an enumeration; None for others."""
        kind = column.signal_type
        if kind == "truth":
            return TRUTH_WORDS.get(text.casefold())
        if not isinstance(kind, EnumType):
            return None
        if text in kind.values:
            return float(kind.values.index(text))
        alike = [k for k, v in enumerate(kind.values) if v.casefold() == text.casefold()]
        return float(alike[0]) if len(alike) == 1 else None

    def _explain_value(self, name: str, text: str, column: ColumnMapping) -> tuple[str, str]:
        """Return why a cell is no value of a column, and what helps."""
        kind = column.signal_type
        if kind == "truth":
            return f"`{text}` in {self.file.noun} `{name}` is no truth value", "TRUE, FALSE, 1 or 0"
        if isinstance(kind, EnumType):
            label = f"`{text}` in {self.file.noun} `{name}` is no value of the enumeration"
            return label, f"its values are {', '.join(filter(None, kind.values))}"
        help = ""
        if re.fullmatch(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?", text):
            help = "a number has no signs of thousands"
        elif DECIMAL.fullmatch(text) and "." in text:
            help = "the decimal sign of this file is the comma"
        elif COMMA_NUMBER.fullmatch(text):
            help = "the decimal sign of this file is the point"
        elif re.fullmatch(r"0[xX][0-9a-fA-F]+", text):
            help = "hexadecimal numbers are not read"
        elif text.casefold() in TRUTH_WORDS:
            help = "the signal is a number; words are for signals of `type: bool`"
        elif text.casefold().lstrip("+-") in ("inf", "infinity"):
            help = "leave the cell blank, with `blank: skip` in the map"
        return f"`{text}` in {self.file.noun} `{name}` is not a finite number", help

    def _to_discrete(self, column: ColumnMapping, value: float, place: Span) -> float:
        """Return a value of a bool, int or enum input as a whole number.

        A value that is none is reported: it is not rounded to one. A whole number outside the range
        of its signal stays: the range of the input holds it, and a fault bit tells it.
        """
        kind = column.signal_type
        number = round(value)
        is_whole = abs(value - number) <= DISCRETE_TOLERANCE and abs(number) <= MAX_INT
        if kind == "truth" and not (is_whole and number in (0, 1)):
            label, help = f"`{column.name}` is {value:.9g}: no truth value", "TRUE, FALSE, 1 or 0"
        elif not is_whole:
            label = f"`{column.name}` is {value:.9g}: no whole number"
            help = "its signal is a whole number"
            if isinstance(kind, EnumType):
                help = "the names or the numbers of " + ", ".join(kind.values)
        else:
            return float(number)
        self.problems.error("value", place, label, help)
        return value

    def _check_unit(self, name: str, written: str, column: ColumnMapping) -> None:
        """Report a unit of the file that is not understood or differs from the unit of the map.

        A text that the map states as `file_unit` is accepted.
        """
        text = written.strip()
        if not text or text == column.file_unit.strip():
            return
        meanings = unit_meanings(text)
        if any(is_same_unit(meaning, column.unit) for meaning in meanings):
            return
        accepted = f'`file_unit: "{text}"` in the map if `unit` is right'
        if not meanings:
            label = f"the unit `{text}` of `{name}` in the file is not understood"
            help = accepted
            equivalent = UNIT_EQUIVALENTS.get(normalise_unit_text(text))
            if equivalent:
                factor, unit = equivalent
                help = f'`unit: {unit}, scale: {factor}, file_unit: "{text}"` in the map'
            self.problems.error("unit", column.span, label, help)
            return
        shown = meanings[0].text
        label = f"the file gives `{name}` in `{shown}`, the map in `{column.unit.text}`"
        help = f"`unit: {shown}` in the map"
        if shown != text:
            label = f"the file gives `{name}` in `{text}` ({shown}), the map in "
            label += f"`{column.unit.text}`"
        self.problems.error("unit", column.span, label, help)


def file_unit(written: str) -> Unit | None:
    """Return the usual meaning of a unit that a file states; None if it is not understood."""
    return next(iter(unit_meanings(written)), None)


def _scale_all(
    values: Sequence[float | None], factor: float, offset: float | None = None
) -> list[float] | None:
    """Return `values * factor + offset` in one vectorised operation.

    The result is None if a value is missing, or a value or result is not finite.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        known = np.array(values, dtype=np.float64)
        scaled = known * factor if offset is None else known * factor + offset
    return scaled.tolist() if np.isfinite(known).all() and np.isfinite(scaled).all() else None


def _row_means(columns: Sequence[Sequence[float | None]]) -> list[float | None]:
    """Return the mean of each row over columns of equal length; None if a cell has no value."""
    means: list[float | None] = []
    for row in zip(*columns, strict=False):
        total = 0.0
        for cell in row:
            total += cell or 0.0
        means.append(None if None in row else total / len(row))
    return means
