"""Time stamp: the exact time [s] of decimal numbers, dates with time, and times of day."""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

DateOrder = Literal["YMD", "DMY", "MDY"]
"""Order of year, month and day in a date."""
StampKind = Literal["date", "day_of_year", "clock"]
"""A date with the time of day, a day of a year with it, or the time of day alone."""
SECONDS_OF_DAY = 24 * 3600
MIDNIGHT_STEP = Fraction(SECONDS_OF_DAY, 2)
"""Step back [s] of times of day from which the stamps have passed midnight."""
TIME = (
    r"(?P<hour>\d{1,2}):(?P<minute>\d\d):(?P<second>\d\d(?:[.,]\d*)?)"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?"
)
"""Pattern of a time of day."""
ZONE = r" ?(?P<zone>Z|UTC|GMT|[+-]\d\d:?\d\d|[+-]\d\d)?"
"""Pattern of a time zone."""
CLOCK = re.compile(TIME, re.ASCII)
DATE = re.compile(
    r"(?P<first>\d{1,4})(?P<sign>[-/.])(?P<middle>\d{1,2})(?P=sign)(?P<last>\d{1,4})"
    r"(?:(?:[Tt_]|,? +)" + TIME + ZONE + ")?",
    re.ASCII,
)
BASIC = re.compile(
    r"(?P<first>\d{4})(?P<middle>\d\d)(?P<last>\d\d)[Tt]"
    r"(?P<hour>\d\d)(?P<minute>\d\d)(?P<second>\d\d(?:[.,]\d*)?)(?P<half>)" + ZONE,
    re.ASCII,
)
DAY_OF_YEAR = re.compile(r"(?P<year>\d{4})[-:](?P<day>\d{3})[:T ]" + TIME + ZONE, re.ASCII)
EPOCH = datetime.date(1970, 1, 1).toordinal()
"""Day number of the origin of dates."""
MAX_ORDER_ROWS = 1_000_000
"""Largest number of stamps that are searched for a day above 12."""


@dataclass(frozen=True)
class CalendarFormat:
    """Format of the stamps of a column: their kind, and the order of dates ("" for no date).

    `evidence` tells why dates have this order.
    """

    kind: StampKind
    order: DateOrder | Literal[""] = ""
    evidence: str = ""


class StampError(ValueError):
    """The error of a stamp that has two meanings or none; `help` tells what helps."""

    def __init__(self, message: str, help: str = "") -> None:
        super().__init__(message)
        self.help = help


def calendar_kind(text: str) -> StampKind | None:
    """Return the kind of a time stamp; None for a text that is no date and no time of day."""
    if CLOCK.fullmatch(text):
        return "clock"
    if DAY_OF_YEAR.fullmatch(text):
        return "day_of_year"
    return "date" if DATE.fullmatch(text) or BASIC.fullmatch(text) else None


def calendar_format(texts: Sequence[str], stated: str = "") -> CalendarFormat | None:
    """Return the format of the first text that is not blank; None if it is a number or unknown.

    `stated` is the order of dates in the map. Raises StampError if the order of day and month does
    not follow from the dates.
    """
    first = next((text for text in texts if text), "")
    kind = calendar_kind(first)
    if kind != "date":
        return CalendarFormat(kind) if kind else None
    match = DATE.fullmatch(first)
    if match is None:
        return CalendarFormat("date", "YMD", "ISO 8601")
    if len(match["first"]) == 4:
        return CalendarFormat("date", "YMD", "the year is first")
    if stated in ("DMY", "MDY"):
        return CalendarFormat(
            "date", "DMY" if stated == "DMY" else "MDY", "`date_order` of the map"
        )
    if len(match["last"]) != 4:
        raise StampError(
            f"the date `{first}` has no year of four digits", "write dates like 2026-01-31T10:30:00"
        )
    if match["sign"] == ".":
        return CalendarFormat("date", "DMY", "a date with points begins with the day")
    for text in texts[:MAX_ORDER_ROWS]:
        found = DATE.fullmatch(text)
        if found and int(found["first"]) > 12:
            return CalendarFormat("date", "DMY", f"`{found['first']}` is no month")
        if found and int(found["middle"]) > 12:
            return CalendarFormat("date", "MDY", f"`{found['middle']}` is no month")
    raise StampError(
        f"the date `{first}` has two meanings: day or month first",
        "`time: {..., date_order: DMY}` or `MDY` in the map, or dates like 2026-01-31T10:30:00",
    )


def parse_calendar_stamp(text: str, form: CalendarFormat) -> tuple[Fraction, bool] | None:
    """Return the time [s] of a stamp and whether it names a time zone; None if it does not fit.

    Dates count from 1970-01-01, in UTC if they name a time zone; times of day from midnight.
    """
    if form.kind == "clock":
        match = CLOCK.fullmatch(text)
        seconds = _seconds_of_day(match) if match else None
        return None if seconds is None else (seconds, False)
    if form.kind == "day_of_year":
        match = DAY_OF_YEAR.fullmatch(text)
        if not match or not 1 <= int(match["day"]) <= 366 or not int(match["year"]):
            return None
        day = datetime.date(int(match["year"]), 1, 1).toordinal() + int(match["day"]) - 1
    else:
        match = DATE.fullmatch(text) or BASIC.fullmatch(text)
        order = form.order if match and match.re is DATE else "YMD"
        if not match:
            return None
        fields = dict(zip(order, (match["first"], match["middle"], match["last"]), strict=True))
        if len(fields["Y"]) != 4:
            return None
        try:
            day = datetime.date(int(fields["Y"]), int(fields["M"]), int(fields["D"])).toordinal()
        except ValueError:
            return None
    seconds = _seconds_of_day(match)
    if seconds is None:
        return None
    zone = match["zone"]
    return (day - EPOCH) * SECONDS_OF_DAY + seconds - _zone_offset(zone), bool(zone)


def _seconds_of_day(match: re.Match[str]) -> Fraction | None:
    """Return the time since midnight [s], 0 without a time of day; None for an impossible one.

    A second of 60 is a leap second.
    """
    if match["hour"] is None:
        return Fraction(0)
    hour, minute = int(match["hour"]), int(match["minute"])
    second = Fraction(match["second"].replace(",", ".").rstrip("."))
    if match["half"]:
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + (12 if match["half"] in "Pp" else 0)
    if hour > 24 or minute > 59 or second >= 61:
        return None
    return hour * 3600 + minute * 60 + second


def _zone_offset(zone: str | None) -> int:
    """Return the offset [s] of a time zone from UTC; 0 for UTC and for no zone."""
    if not zone or zone[0] not in "+-":
        return 0
    digits = zone[1:].replace(":", "").ljust(4, "0")
    seconds = int(digits[:2]) * 3600 + int(digits[2:]) * 60
    return -seconds if zone[0] == "-" else seconds


def describe_calendar(form: CalendarFormat) -> str:
    """Return the format in words, for the table of assumptions."""
    if form.kind == "clock":
        return "times of day, in seconds since midnight"
    if form.kind == "day_of_year":
        return "year and day of the year, in seconds since 1970-01-01"
    order = {"YMD": "year, month, day", "DMY": "day, month, year", "MDY": "month, day, year"}
    return f"dates ({order[form.order or 'YMD']}), in seconds since 1970-01-01"


def explain_time_text(text: str) -> str:
    """Return what helps for a text that looks like a time and is none that is read."""
    if re.fullmatch(r"\d{1,2}:\d\d(?:[.,]\d+)?", text):
        return "a time of day has hours, minutes and seconds: 10:30:25.010"
    if re.fullmatch(r"\d{1,2}:\d\d:\d\d:\d+", text):
        return "write the fraction of a second behind a point: 10:30:25.010"
    return ""
