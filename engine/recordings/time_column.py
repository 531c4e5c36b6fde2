"""Time column: converts the texts of a column to exact time stamps in seconds."""

from __future__ import annotations

import itertools
import math
import re
from fractions import Fraction
from functools import lru_cache

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
from language.expressions.unit_spellings import unit_meanings
from language.expressions.units import SECOND, Unit, are_compatible, is_same_unit
from language.model.system import RecordingMap
from language.text.diagnostic import Problems, Span

ROUNDED_STAMP = re.compile(r"[+-]?(\d(?:[.,]\d{1,5})?)[eE][+-]?\d+", re.ASCII)
"""Pattern of a number with an exponent and few digits."""
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


class TimeColumnReader:
    """Reader of the time columns of a file by a map; problems are reported."""

    def __init__(self, file: RecordedFile, mapping: RecordingMap, problems: Problems) -> None:
        self.file = file
        self.mapping = mapping
        self.problems = problems
        self.assumptions: list[Assumption] = []

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
                    report_unsorted(text, value, last, samples.place(k), self.problems)
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
                report_unsorted(text, value, last, samples.place(k), self.problems)
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
        if not text or any(is_same_unit(meaning, unit) for meaning in meanings):
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
        if text.casefold() in (name.casefold() for name in self.file.names):
            help = "the names of the columns stand here again: split recordings that follow each "
            help += "other"
        if DECIMAL.fullmatch(text) and len(text) <= MAX_STAMP_LENGTH:
            help = _propose_epoch_unit(Fraction(text), self.mapping.time_unit)
        return _explain_stamp(text), help


def report_unsorted(
    text: str, value: Fraction, last: Fraction, place: Span, problems: Problems
) -> None:
    """Report a time stamp (`text`, with its value) that is not above the previous one."""
    label = f"the time stamp {text} is not above the one before, {float(last)!r}"
    rounded = ROUNDED_STAMP.fullmatch(text)
    if value < last:
        hint = "sort the recording; if its clock begins anew here, split it"
    elif rounded:
        hint = f"the stamps have only {sum(c.isdigit() for c in rounded[1])} digits: a spreadsheet "
        hint += "writes what it shows"
    else:
        hint = "sort the recording, and remove repeated rows"
    problems.error("time", place, label, hint)


def _propose_epoch_unit(value: Fraction, unit: Unit) -> str:
    """Return the unit in which a large stamp is an epoch of this century; empty if none is."""
    names = ("s", "ms", "us", "ns")
    for exponent, name in enumerate(names):
        if EPOCH_RANGE[0] <= value / 1000**exponent <= EPOCH_RANGE[1] and name != unit.text:
            return f"it is an epoch of this century in {name}: `unit: {name}` in `time` of the map"
    return ""


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
