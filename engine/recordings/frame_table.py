"""Frame table: CAN frames in a text table with a head line, such as the CSV files of SavvyCAN.

The columns are known by their names: the time, the identifier, the data in one column or byte by
byte, and perhaps the bus, the length, and flags. All numbers but the time are hexadecimal.
"""

from __future__ import annotations

import base64
import csv
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from engine.recordings.frame_text import (
    HEAD_LINES,
    MAX_EXTENDED,
    MAX_STANDARD,
    FrameTextError,
    LoggedFrame,
    bus_name,
    parse_bytes,
)
from engine.recordings.recording_file import Assumption
from engine.recordings.time_stamp import (
    CalendarFormat,
    StampError,
    calendar_format,
    describe_calendar,
    parse_calendar_stamp,
)
from language.expressions.units import Unit

SEPARATORS = ("\t", ";", ",")
"""Separators of the columns."""
ROLES = {
    "id": ("id", "canid", "arbitrationid", "identifier", "messageid", "msgid", "frameid"),
    "data": ("data", "databytes", "payload"),
    "length": ("datalength", "len", "length", "dlc", "size"),
    "extended": ("extended", "ext", "ide", "isextendedid", "extendedid"),
    "bus": ("bus", "buschannel", "channel", "ch", "can", "port", "interface"),
    "error": ("error", "iserrorframe"),
    "remote": ("remote", "rtr", "isremoteframe"),
}
"""Names of columns, without blanks and in lower case; the first one that a table has is used."""
TIME_NAME = re.compile(r"(?:time|timestamp|timestampepoch|t|abstime)(s|sec|ms|us|ns)?")
"""Name of the column of time, with its unit."""
BYTE_NAME = re.compile(r"(?:d|b|byte|data|db)(\d)")
"""Name of the column of a byte."""
UNITS = {
    "s": Fraction(1), "sec": Fraction(1), "ms": Fraction(1, 10**3), "us": Fraction(1, 10**6),
    "ns": Fraction(1, 10**9),
}  # fmt: skip
"""Units of time in the name of a column [s]."""
SAVVYCAN = ("timestamp", "extended", "bus")
"""Columns of a table whose whole time stamps are microseconds, if they fit: SavvyCAN writes it."""
MAX_STAMP_LENGTH = 40
"""Number of characters of a time stamp."""
MAX_STAMP = 10**30
"""Bound of the number of a time stamp in any unit."""
MAX_RATE = 22000
"""Largest number of frames on a bus in a second: frames without data at 1 Mbit/s, 47 bits each."""
MIN_RATE = 20
"""Smallest number of frames in a second that a log of a vehicle or of a test rig has."""
PROPOSED_UNITS = ("s", "ms", "us", "ns")
"""Units of time that are proposed."""
DECIMAL = re.compile(r"[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d{1,3})?")
"""A time stamp that is a number."""


@dataclass
class FrameTable:
    """Head of a table of frames: its line, separator, and the columns by their roles.

    `time_name` is the name of the column of time in the file, `columns` are the columns by roles,
    `bytes` those of single bytes. `names` are the names without blanks, in lower case.
    """

    line: int
    separator: str
    time_name: str
    unit: str
    names: Sequence[str]
    columns: Mapping[str, int]
    bytes: Sequence[int]
    assumptions: list[Assumption] = field(default_factory=list)


def find_frame_table(lines: Sequence[str]) -> FrameTable | None:
    """Return the head of a table of frames among the first lines; None without one."""
    for number, line in enumerate(lines[:HEAD_LINES], start=1):
        for separator in SEPARATORS:
            table = _read_head(number, line, separator) if separator in line else None
            if table is not None:
                return table
    return None


def propose_time_unit(lines: Sequence[str]) -> tuple[str, str, str] | None:
    """Return the time column of a table of frames, its unit and the reason; None if there is none.

    It is the only unit in which the rows are neither more than the buses carry nor fewer than
    `MIN_RATE` a second.
    """
    table = find_frame_table(lines)
    if table is None or table.unit:
        return None
    rows = [_split(line, table.separator) for line in lines[table.line :] if line.strip()]
    place = max(table.columns["time"], table.columns.get("bus", 0))
    rows = [row for row in rows if len(row) > place]
    stamps = [_parse_number(row[table.columns["time"]].strip()) for row in rows]
    known = [stamp for stamp in stamps if stamp is not None]
    if not known or any(stamp.denominator != 1 for stamp in known):
        return None
    buses = len({row[table.columns["bus"]] for row in rows}) if "bus" in table.columns else 1
    span = max(known) - min(known)
    rates = {unit: len(known) / float(span * UNITS[unit]) for unit in PROPOSED_UNITS if span}
    fitting = [unit for unit, rate in rates.items() if MIN_RATE <= rate <= buses * MAX_RATE]
    if len(fitting) != 1:
        return None
    reason = f"{rates[fitting[0]]:.0f} frames a second fit a bus, in other units they do not"
    return table.time_name, fitting[0], reason


def _read_head(number: int, line: str, separator: str) -> FrameTable | None:
    """Return the head of a table of frames; None for another line."""
    written = [name.strip() for name in _split(line, separator)]
    names = [re.sub(r"[^a-z0-9]", "", name.lower()) for name in written]
    columns: dict[str, int] = {}
    for role, known in ROLES.items():
        found = [names.index(name) for name in known if name in names]
        if found:
            columns[role] = found[0]
    times = [(k, match) for k, name in enumerate(names) if (match := TIME_NAME.fullmatch(name))]
    numbered = {int(match[1]): k for k, n in enumerate(names) if (match := BYTE_NAME.fullmatch(n))}
    in_order = [numbered[k] for k in sorted(numbered)]
    if not times or "id" not in columns or not ("data" in columns or in_order):
        return None
    column, match = times[0]
    columns["time"] = column
    return FrameTable(number, separator, written[column], match[1] or "", names, columns, in_order)


def _split(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator), [])


def read_frame_table(
    table: FrameTable, lines: Sequence[tuple[int, str]], time: str, unit: Unit, date_order: str
) -> tuple[list[tuple[int, LoggedFrame]], list[tuple[int, str]]]:
    """Return the frames of a table with the numbers of their lines, and the lines that are none.

    `time`, `unit` and `date_order` are those of the map; the unit counts if the map names the
    column of time. What is assumed is added to the table. Raises FrameTextError if the unit of time
    is not known.
    """
    body = [(number, _split(line, table.separator)) for number, line in lines]
    rows = [(number, cells) for number, cells in body if any(cells)]
    parse = _data_parser(table, [cells for _, cells in rows])
    parsed: list[tuple[int, str, LoggedFrame]] = []
    bad: list[tuple[int, str]] = []
    for number, cells in rows:
        try:
            parsed.append((number, cells[table.columns["time"]].strip(), parse(cells)))
        except (ValueError, IndexError):
            bad.append((number, table.separator.join(cells)))
    stamps = _read_stamps(table, parsed, time, unit, date_order)
    frames = []
    for (number, text, frame), stamp in zip(parsed, stamps, strict=True):
        if stamp is None:
            bad.append((number, text))
        else:
            frames.append((number, frame._replace(timestamp=float(stamp))))
    return frames, bad


def _data_parser(
    table: FrameTable, rows: Sequence[Sequence[str]]
) -> Callable[[Sequence[str]], LoggedFrame]:
    """Return the function that reads the frame of a row, without its stamp.

    It raises ValueError for a row that is no frame.
    """
    columns, numbered = table.columns, table.bytes
    base = 16
    if numbered and any(len(row[k].strip()) > 2 for row in rows for k in numbered if k < len(row)):
        base = 10
        reason = "some have three digits"
        table.assumptions.append(Assumption("data bytes", "decimal", reason))
    is_base64 = "data" in columns and table.names[columns["id"]] == "arbitrationid"
    ids = [row[columns["id"]].strip() for row in rows if len(row) > columns["id"]]
    if ids and not any(re.search(r"[a-fA-FxX]", text) for text in ids):
        reason = "no identifier of the log shows it"
        table.assumptions.append(Assumption("identifiers", "hexadecimal", reason))

    def cell(row: Sequence[str], role: str) -> str:
        return row[columns[role]].strip() if role in columns else ""

    def parse(row: Sequence[str]) -> LoggedFrame:
        text = cell(row, "id").lower().removesuffix("x").removesuffix("h")
        identifier = int(text, 16)
        length = int(cell(row, "length") or -1)
        if numbered:
            cells = [row[k].strip() if k < len(row) else "" for k in numbered]
            count = length if 0 <= length <= len(cells) else sum(map(bool, cells))
            data = bytes(int(one, base) for one in cells[:count])
        elif is_base64:
            data = base64.b64decode(cell(row, "data"), validate=True)
        else:
            data = parse_bytes(cell(row, "data"))
        if not 0 <= identifier <= MAX_EXTENDED or (length >= 0 and not _fits(length, len(data))):
            raise ValueError(row)
        is_extended = identifier > MAX_STANDARD or _is_true(cell(row, "extended"))
        bus = bus_name(cell(row, "bus"))
        flags = _is_true(cell(row, "error")), _is_true(cell(row, "remote"))
        return LoggedFrame(0.0, bus, identifier, is_extended, data, *flags)

    return parse


def _fits(length: int, count: int) -> bool:
    """Return whether a number of data bytes fits a length, which may be the code of CAN FD."""
    codes = {9: 12, 10: 16, 11: 20, 12: 24, 13: 32, 14: 48, 15: 64}
    return count in (length, codes.get(length))


def _is_true(text: str) -> bool:
    """Return whether a flag is set."""
    return text.lower() in ("1", "true", "yes", "x")


def _read_stamps(
    table: FrameTable,
    frames: Sequence[tuple[int, str, LoggedFrame]],
    time: str,
    unit: Unit,
    date_order: str,
) -> list[Fraction | None]:
    """Return the stamps [s] of the frames; None for a text that is no stamp."""
    texts = [text for _, text, _ in frames]
    numbers = [_parse_number(text) for text in texts]
    if all(number is None for number in numbers):
        return _read_dates(table, texts, date_order)
    factor = _time_unit(table, frames, numbers, time, unit)
    return [None if number is None else factor * number for number in numbers]


def _parse_number(text: str) -> Fraction | None:
    """Return a time stamp exactly; None for a text that is no number or none of a time."""
    if len(text) > MAX_STAMP_LENGTH or not DECIMAL.fullmatch(text):
        return None
    number = Fraction(text.replace(",", "."))
    return number if abs(number) < MAX_STAMP else None


def _read_dates(table: FrameTable, texts: Sequence[str], date_order: str) -> list[Fraction | None]:
    """Return the stamps of dates and times of day.

    Raises FrameTextError for dates of two meanings.
    """
    try:
        form: CalendarFormat | None = calendar_format(texts, date_order)
    except StampError as error:
        raise FrameTextError(table.line + 1, str(error), error.help) from None
    if form is None:
        return [None] * len(texts)
    table.assumptions.append(Assumption("time", describe_calendar(form), "the form of the stamps"))
    found = [parse_calendar_stamp(text, form) for text in texts]
    return [None if stamp is None else stamp[0] for stamp in found]


def _time_unit(
    table: FrameTable,
    frames: Sequence[tuple[int, str, LoggedFrame]],
    numbers: Sequence[Fraction | None],
    time: str,
    unit: Unit,
) -> Fraction:
    """Return the unit of time [s]: that of the map, of the name, or of the program that writes it.

    Stamps with decimals are seconds. Raises FrameTextError if the unit is not known.
    """
    name = table.time_name
    known = [number for number in numbers if number is not None]
    if time == name:
        return Fraction(unit.factor)
    if table.unit:
        return UNITS[table.unit]
    if any(number.denominator != 1 for number in known):
        reason = "the time stamps have decimals"
        table.assumptions.append(Assumption(f"unit of `{name}`", "s", reason))
        return Fraction(1)
    help = f"`time: {{column: {name}, unit: ms}}` in the map states it"
    if not all(one in table.names for one in SAVVYCAN):
        reason = f"the unit of the time `{name}` is not known"
        raise FrameTextError(table.line, reason, help)
    buses = [frame.channel for _, _, frame in frames]
    most = max(Counter(buses).values())
    span = float(max(known) - min(known))
    if most > MAX_RATE * max(span, 1.0) / 1e6 + 2:
        reason = f"the unit of the time `{name}` is not known: {most} frames of a bus in "
        reason += f"{span:g} us are more than a bus carries"
        raise FrameTextError(table.line, reason, help)
    reason = "SavvyCAN writes such tables"
    table.assumptions.append(Assumption(f"unit of `{name}`", "us", reason))
    return Fraction(1, 10**6)
