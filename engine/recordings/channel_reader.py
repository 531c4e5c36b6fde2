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

from engine.recordings.recording_file import MAX_PROBLEMS, Assumption, RecordedFile, Samples
from engine.recordings.text_dialect import DECIMAL
from engine.recordings.time_stamp import (
    MIDNIGHT_STEP,
    SECONDS_OF_DAY,
    CalendarFormat,
    StampError,
    calendar_format,
    describe_calendar,
    explain_time_text,
    parse_calendar_stamp,
)
from language.expressions.unit_spellings import UNIT_EQUIVALENTS, normalise_unit_text, unit_meanings
from language.expressions.units import SECOND, Unit, are_compatible
from language.model.system import ColumnMapping, RecordingMap
from language.text.diagnostic import Problems, Span, suggest_name
from language.typecheck.types import MAX_INT, EnumType

MAX_STAMP_LENGTH = 40
"""Largest number of characters of a time stamp."""
TIME_LIMIT = 10**12
"""Bound on the magnitude of time stamps [s]."""
EPOCH_RANGE = (10**9, 4 * 10**9)
"""Range of epochs [s], from the year 2001 to 2096, in which a better unit is proposed."""
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
DISCRETE_TOLERANCE = 1e-6
"""Largest distance of a value from a whole number that stands for it; scales leave roundings."""
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
        self.assumptions: list[Assumption] = []
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

        A stamp is a decimal number in the unit of the map, a date or a time of day; all stamps of a
        column have the form of the first. A number is invalid if it is longer than
        `MAX_STAMP_LENGTH` or not below `TIME_LIMIT`. Invalid stamps are reported, and stamps that
        are not above the last valid one (these are kept). Blank cells are reported in the main time
        column only. Reading stops after `MAX_PROBLEMS` problems; the list is then shorter than the
        column.
        """
        samples = self.file.read(name)
        factor = self.mapping.time_unit.factor
        stamps = None if self.has_max_problems else _parse_plain_stamps(samples, factor)
        if stamps is not None:
            self._check_time_unit(name, samples.unit)
            return [value * factor for value in stamps] if factor != 1 else [*stamps]
        form = self._calendar_format(samples)
        if form is not None:
            return self._calendar_times(name, samples, form)
        self._check_time_unit(name, samples.unit)
        result: list[Fraction | None] = []
        last: Fraction | None = None
        rounded = -math.inf
        for k in range(len(samples.values)):
            if self.has_max_problems:
                break
            text = samples.text(k)
            value = _parse_stamp(text, factor)
            number = samples.values[k]
            if number is not None and math.isnan(number):
                value = None
            if value is not None:
                value = value * factor if factor != 1 else value
            elif name == self.mapping.time or (text and number is not None):
                label, help = self._explain_stamp(text)
                self.problems.error("time", samples.place(k), label, help)
            if value is not None:
                number = number or 0.0
                if last is not None and number <= rounded and value <= last:
                    self._report_unsorted(text, last, samples.place(k))
                last, rounded = value, number
            result.append(value)
        return result

    def _calendar_format(self, samples: Samples) -> CalendarFormat | None:
        """Return the format of dates or times of day; None for numbers and unknown texts.

        Dates with two meanings are reported.
        """
        texts = [samples.text(k) for k, value in enumerate(samples.values) if value is not None]
        try:
            return calendar_format(texts, self.mapping.date_order)
        except StampError as error:
            first = next(k for k, value in enumerate(samples.values) if value is not None)
            self.problems.error("time", samples.place(first), str(error), error.help)
        self.problems.raise_if_errors()
        return None

    def _calendar_times(
        self, name: str, samples: Samples, form: CalendarFormat
    ) -> list[Fraction | None]:
        """Return the times [s] of dates or times of day; None for a blank or invalid cell.

        A time of day that steps back by half a day or more has passed midnight. Reported are
        stamps of another form, a time zone in some of the stamps only, and stamps that do not
        increase.
        """
        result: list[Fraction | None] = []
        last: Fraction | None = None
        days, with_zone = 0, None
        for k in range(len(samples.values)):
            if self.has_max_problems:
                break
            text = samples.text(k)
            parsed = parse_calendar_stamp(text, form)
            if parsed is None:
                result.append(None)
                is_blank = samples.values[k] is None
                if name == self.mapping.time or not is_blank:
                    label, help = self._explain_stamp(text)
                    if not is_blank:
                        label = f"the time stamp `{text[:MAX_STAMP_LENGTH]}` is not like the first"
                        help = f"the first one has {describe_calendar(form)}"
                    self.problems.error("time", samples.place(k), label, help)
                continue
            value, has_zone = parsed
            if with_zone is not None and has_zone != with_zone:
                label = "some time stamps of the column have a time zone, others do not"
                self.problems.error("time", samples.place(k), label)
                break
            with_zone = has_zone
            value += days * SECONDS_OF_DAY
            if form.kind == "clock" and last is not None and last - value >= MIDNIGHT_STEP:
                days, value = days + 1, value + SECONDS_OF_DAY
            if last is not None and value <= last:
                self._report_unsorted(text, last, samples.place(k))
            last = value
            result.append(value)
        self._note_calendar(name, form, days, bool(with_zone))
        return result

    def _note_calendar(self, name: str, form: CalendarFormat, days: int, has_zone: bool) -> None:
        """Note the format of dates or times of day in a time column."""
        reason = form.evidence or "the form of the stamps"
        if form.kind != "clock" and not has_zone:
            reason += "; without a time zone, taken as UTC"
        if days:
            reason += f"; midnight is passed {days} times" if days > 1 else "; midnight is passed"
        value = describe_calendar(form)
        self.assumptions.append(Assumption(f"time column `{name}`", value, reason))

    def _check_time_unit(self, name: str, written: str) -> None:
        """Report a unit of the file that is not the unit of time of the map."""
        text, unit = written.strip(), self.mapping.time_unit
        meanings = unit_meanings(text)
        if not text or any(_is_same_unit(meaning, unit) for meaning in meanings):
            return
        times = [meaning.text for meaning in meanings if are_compatible(meaning.dimension, SECOND)]
        label = f"the file gives the time `{name}` in `{text}`, the map in `{unit.text}`"
        help = f"`unit: {times[0]}` in `time` of the map" if times else "it is no unit of time"
        self.problems.error("unit", self.file.header_span, label, help)

    def _explain_stamp(self, text: str) -> tuple[str, str]:
        """Return why a text is no time stamp, and what helps."""
        if not text:
            return "no time stamp", ""
        help = explain_time_text(text)
        if DECIMAL.fullmatch(text) and len(text) <= MAX_STAMP_LENGTH:
            help = _propose_epoch_unit(Fraction(text), self.mapping.time_unit)
        return _explain_stamp(text), help

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
        self.assumptions += [item for part in parts for item in part.assumptions]
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
        scaled = None if self.has_max_problems else _scale_all(values, factor, offset)
        if scaled is not None:
            return [*scaled]
        result: list[float | None] = []
        for k, value in enumerate(values):
            if self.has_max_problems:
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
        if any(_is_same_unit(meaning, column.unit) for meaning in meanings):
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


def _is_same_unit(first: Unit, second: Unit) -> bool:
    """Return whether two units have the same dimension, factor and offset."""
    same = (first.factor, first.offset) == (second.factor, second.offset)
    return same and are_compatible(first.dimension, second.dimension)


def _propose_epoch_unit(value: Fraction, unit: Unit) -> str:
    """Return the unit in which a large stamp is an epoch of this century; empty if none is."""
    names = ("s", "ms", "us", "ns")
    for exponent, name in enumerate(names):
        if EPOCH_RANGE[0] <= value / 1000**exponent <= EPOCH_RANGE[1] and name != unit.text:
            return f"it is an epoch of this century in {name}: `unit: {name}` in `time` of the map"
    return ""


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


def _parse_plain_stamps(samples: Samples, factor: Fraction) -> list[Fraction] | None:
    """Return increasing time stamps without exponents in one pass.

    `factor` is their unit [s]. The result is None if some stamp is blank, has an exponent, is not
    above its predecessor or is out of range.
    """
    numbers = [value for value in samples.values if value is not None]
    is_growing = all(after > before for before, after in itertools.pairwise(numbers))
    if not numbers or len(numbers) < len(samples.values) or not is_growing:
        return None
    texts = [samples.text(k) for k in range(len(numbers))]
    if not STAMP_LINES.fullmatch("\n".join(texts)) or max(map(len, texts)) > MAX_STAMP_LENGTH:
        return None
    stamps = [_parse_plain_stamp(text) for text in texts]
    return stamps if max(-stamps[0], stamps[-1]) * factor < TIME_LIMIT else None


@lru_cache(STAMP_CACHE_SIZE)
def _parse_plain_stamp(text: str) -> Fraction:
    """Return a decimal number without an exponent exactly; results are cached."""
    whole, _, part = text.partition(".")
    return Fraction(int(whole + part), POWERS_OF_TEN[len(part)])


def _parse_stamp(text: str, factor: Fraction) -> Fraction | None:
    """Return a decimal number exactly; None if it is no number, too long or beyond `TIME_LIMIT`.

    `factor` is the unit of the stamp [s].
    """
    if len(text) > MAX_STAMP_LENGTH or not DECIMAL.fullmatch(text):
        return None
    whole, _, part = text.partition(".")
    is_plain = "e" not in text and "E" not in text
    value = Fraction(int(whole + part), 10 ** len(part)) if is_plain else Fraction(text)
    return value if abs(value * factor) < TIME_LIMIT else None


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
    return f"{label} is too large: its magnitude must be below {TIME_LIMIT:.0e} s"
