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
from functools import cached_property, lru_cache

import numpy as np

from engine.recordings.csv_reader import DECIMAL
from engine.recordings.recording_file import MAX_PROBLEMS, Note, RecordedFile, Samples
from language.expressions.units import Unit, UnitError, are_compatible, parse_unit
from language.model.system import ColumnMapping, RecordingMap
from language.text.diagnostic import Problems, Span, suggest_name

MAX_STAMP_LENGTH = 40
"""Largest number of characters of a time stamp."""
TIME_LIMIT = 10**12
"""Bound on the magnitude of time stamps, in their unit."""
STAMP_PATTERN = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)"
"""Pattern of a decimal number without an exponent."""
STAMP_LINES = re.compile(rf"(?:{STAMP_PATTERN}\n)*+{STAMP_PATTERN}", re.ASCII)
"""Pattern of decimal numbers without exponents, one on each line, as in most time columns."""
INFINITY = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE | re.ASCII)
"""Pattern of an infinite number."""
STAMP_CACHE_SIZE = 2**16
"""Number of cached time stamps; recordings of one logger often share their stamps."""
POWERS_OF_TEN = [10**k for k in range(MAX_STAMP_LENGTH + 1)]
"""10**k by index k."""
LOGGER_UNITS = {
    "Nm": "N*m", "1/min": "rpm", "U/min": "rpm", "r/min": "rpm", "kph": "km/h", "m/s2": "m/s^2",
    "\N{DEGREE SIGN}C": "degC", "\N{DEGREE SIGN}": "deg",
}  # fmt: skip
"""Units as loggers and DBC files write them."""

UNSTATED = ("", "-", "--")
"""Texts of a file that states no unit."""


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
            problems.error("column", file.header_span, label, hint)
        elif count > 1:
            label = f"there are {'two' if count == 2 else count} {file.noun}s `{name}`"
            problems.error("column", file.header_span, label, file.explain_ambiguous(name))
    if not file.rows:
        label = "the recording has a head line and no values"
        if file.is_stamped:
            label = "the recording has no values"
        problems.error("empty", file.header_span, label)


class ChannelReader:
    """Reader of channels of a file by a map, with exact time stamps."""

    def __init__(self, file: RecordedFile, mapping: RecordingMap, problems: Problems) -> None:
        """Read the time column that all rows share, if the format has one.

        Problems are reported.
        """
        self.file = file
        self.mapping = mapping
        self.problems = problems
        self.notes: list[Note] = []
        self.clock = [] if file.is_stamped else self.times(mapping.time)

    @cached_property
    def shared_times(self) -> tuple[Fraction, ...]:
        """Time stamps [s] that all columns share.

        They are empty if one is blank or invalid, and for a file whose channels have their own.
        """
        known = tuple(time for time in self.clock if time is not None)
        return known if len(known) == len(self.clock) else ()

    @property
    def has_max_problems(self) -> bool:
        """Return whether `MAX_PROBLEMS` or more problems are reported, so that reading can stop."""
        return len(self.problems.reported) >= MAX_PROBLEMS

    def times(self, name: str) -> list[Fraction | None]:
        """Return the exact time stamps of a column [s]; None for a blank or invalid cell.

        A stamp is invalid if it is no decimal number, longer than `MAX_STAMP_LENGTH` or not below
        `TIME_LIMIT` in its unit. Invalid stamps are reported, and stamps that are not above the
        last valid one (these are kept). Blank cells are reported in the main time column only.
        Reading stops after `MAX_PROBLEMS` problems; the list is then shorter than the column.
        """
        samples = self.file.read(name)
        factor = self.mapping.time_unit.factor
        stamps = None if self.has_max_problems else _parse_plain_stamps(samples)
        if stamps is not None:
            return [value * factor for value in stamps] if factor != 1 else [*stamps]
        result: list[Fraction | None] = []
        last: Fraction | None = None
        rounded = -math.inf
        for k in range(len(samples.values)):
            if self.has_max_problems:
                break
            text = samples.text(k)
            value = _parse_stamp(text)
            if value is not None:
                value = value * factor if factor != 1 else value
            elif name == self.mapping.time or text:
                label = _explain_stamp(text) if text else "no time stamp"
                self.problems.error("time", samples.place(k), label)
            if value is not None:
                number = samples.values[k] or 0.0
                if last is not None and number <= rounded and value <= last:
                    self._report_unsorted(text, last, samples.place(k))
                last, rounded = value, number
            result.append(value)
        return result

    def _report_unsorted(self, text: str, last: Fraction, place: Span) -> None:
        """Report a time stamp that is not above the previous one."""
        label = f"the time stamp {text} is not above the one before, {float(last)!r}"
        hint = "sort the recording, and remove repeated rows"
        self.problems.error("time", place, label, hint)

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
            if after <= before and not self.has_max_problems:
                self._report_unsorted(repr(float(after)), before, parts[0].place(k))
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
        self.notes += [Note(column.name, text) for part in parts for text in part.notes]
        if self.file.is_stamped:
            stamps = self._own_stamps(column, parts)
        else:
            stamps = self.times(column.time) if column.time else self.clock
        cells = [
            self._values(name, part, column)
            for name, part in zip(column.columns, parts, strict=True)
        ]
        times: list[Fraction] = []
        values_si: list[float] = []
        scale = float(column.scale[0]) * column.sign
        means = cells[0] if len(cells) == 1 else _row_means(cells)
        if stamps is self.clock and len(self.shared_times) == len(means) > 0 and not column.delay:
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
        scaled = None if self.has_max_problems else _scale_all(samples.values, factor, offset)
        if scaled is not None:
            return [*scaled]
        result: list[float | None] = []
        for k, value in enumerate(samples.values):
            if self.has_max_problems:
                break
            if value is not None and not math.isfinite(value):
                label = f"`{samples.text(k)}` in {self.file.noun} `{name}` is not a finite number"
                self.problems.error("value", samples.place(k), label)
                value = None
            elif value is None and column.blank == "refuse":
                label = f"{self.file.noun} `{name}` has no value here"
                hint = "`blank: skip` in the map leaves empty cells out"
                self.problems.error("value", samples.place(k), label, hint)
            result.append(None if value is None else value * factor + offset)
        return result

    def _check_unit(self, name: str, written: str, column: ColumnMapping) -> None:
        """Report a unit of the file that is unknown or differs from the unit of the map.

        Units in `UNSTATED` and the unit that the map accepts (`file_unit`) are not reported.
        """
        written = written.strip()
        if written in (*UNSTATED, column.file_unit.strip()):
            return
        unit = file_unit(written)
        accept = f"`file_unit: '{written}'` in the map takes it as `{column.unit.text}`"
        if unit is None:
            label = f"the file gives `{name}` in `{written}`, which is no known unit"
            self.problems.error("unit", column.span, label, accept)
            return
        text = unit.text
        same = are_compatible(unit.dimension, column.unit.dimension)
        if not same or (unit.factor, unit.offset) != (column.unit.factor, column.unit.offset):
            label = f"the file gives `{name}` in `{text}`, the map in `{column.unit.text}`"
            hint = f"`unit: {text}` in the map; {accept}"
            self.problems.error("unit", column.span, label, hint)


def file_unit(written: str) -> Unit | None:
    """Return the unit that a logger or a DBC file writes; None if it is unknown.

    `LOGGER_UNITS` translates special spellings; other texts are units of modewright.
    """
    try:
        return parse_unit(LOGGER_UNITS.get(written, written))
    except UnitError:
        return None


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


def _parse_plain_stamps(samples: Samples) -> list[Fraction] | None:
    """Return increasing time stamps without exponents in one pass.

    The result is None if some stamp is blank, has an exponent, is not above its predecessor or is
    out of range.
    """
    numbers = [value for value in samples.values if value is not None]
    is_growing = all(after > before for before, after in itertools.pairwise(numbers))
    if not numbers or len(numbers) < len(samples.values) or not is_growing:
        return None
    texts = [samples.text(k) for k in range(len(numbers))]
    if not STAMP_LINES.fullmatch("\n".join(texts)) or max(map(len, texts)) > MAX_STAMP_LENGTH:
        return None
    stamps = [_parse_plain_stamp(text) for text in texts]
    return stamps if max(-stamps[0], stamps[-1]) < TIME_LIMIT else None


@lru_cache(STAMP_CACHE_SIZE)
def _parse_plain_stamp(text: str) -> Fraction:
    """Return a decimal number without an exponent exactly; results are cached."""
    whole, _, part = text.partition(".")
    return Fraction(int(whole + part), POWERS_OF_TEN[len(part)])


def _parse_stamp(text: str) -> Fraction | None:
    """Return a decimal number exactly; None if it is no number, too long or beyond `TIME_LIMIT`."""
    if len(text) > MAX_STAMP_LENGTH or not DECIMAL.fullmatch(text):
        return None
    whole, _, part = text.partition(".")
    is_plain = "e" not in text and "E" not in text
    value = Fraction(int(whole + part), 10 ** len(part)) if is_plain else Fraction(text)
    return value if abs(value.numerator) < TIME_LIMIT * value.denominator else None


def _explain_stamp(text: str) -> str:
    """Return why a text is no time stamp: infinite, too long, too large or no number."""
    shown = text if len(text) <= MAX_STAMP_LENGTH else text[:MAX_STAMP_LENGTH] + "..."
    label = f"the time stamp `{shown}`"
    if INFINITY.fullmatch(text):
        return f"{label} is not finite"
    if not DECIMAL.fullmatch(text):
        return f"{label} is not a number"
    if len(text) > MAX_STAMP_LENGTH:
        return f"{label} has more than {MAX_STAMP_LENGTH} characters"
    return f"{label} is too large: its magnitude must be below {TIME_LIMIT:.0e}"
