"""Frame text: CAN frames of text logs that python-can does not read, line by line.

The logs of BUSMASTER, of the CAN BUS Analyzer of Microchip, of CANHacker and CARBUS Analyzer, of
PP2CAN, and what `candump` writes to the screen.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from decimal import Decimal
from typing import NamedTuple

MAX_STANDARD = 0x7FF
"""Largest identifier of 11 bits."""
MAX_EXTENDED = 0x1FFFFFFF
"""Largest identifier of 29 bits."""
HEAD_LINES = 40
"""Number of lines at the start of a log that show its format."""
FRAME_START = re.compile(r"\s*[<>(]?\s*\d[.:;\d]*[);\s][^\r\n]*[0-9A-F]{2}")
"""Pattern of the start of a line that may be a frame."""
BYTES = r"(?P<data>[0-9A-FX\s;]*)"
"""Pattern of the characters of data bytes."""


class LoggedFrame(NamedTuple):
    """A data frame: stamp [s], name of the bus (empty if unknown), identifier and data."""

    timestamp: float
    channel: str
    arbitration_id: int
    is_extended_id: bool
    data: bytes
    is_error_frame: bool = False
    is_remote_frame: bool = False


class FrameTextError(Exception):
    """A log of a known format that cannot be read: `line`, the reason, and what helps."""

    def __init__(self, line: int, reason: str, help: str) -> None:
        super().__init__(reason)
        self.line = line
        self.help = help


def _seconds(text: str) -> Decimal:
    """Return a stamp in seconds, with a decimal point or a comma."""
    return Decimal(text.replace(",", "."))


def _milliseconds(text: str) -> Decimal:
    """Return a stamp in milliseconds as seconds."""
    return Decimal(text) / 1000


def _clock_fraction(text: str) -> Decimal:
    """Return the seconds of `22:20:14:9921`, whose last part are decimals."""
    hours, minutes, seconds, decimals = text.split(":")
    return _clock(hours, minutes, f"{seconds}.{decimals}")


def _clock_milliseconds(text: str) -> Decimal:
    """Return the seconds of `17:18:39.55`, whose last part are 55 milliseconds."""
    clock, _, milliseconds = text.partition(".")
    return _clock(*clock.split(":")) + Decimal(milliseconds) / 1000


def _clock(hours: str, minutes: str, seconds: str) -> Decimal:
    """Return the seconds since midnight."""
    return 3600 * Decimal(hours) + 60 * Decimal(minutes) + Decimal(seconds)


def _seconds_or_date(text: str) -> Decimal:
    """Return a stamp in seconds, or a date with a time of day (UTC) as seconds since 1970."""
    if " " not in text:
        return Decimal(text)
    whole, _, decimals = text.partition(".")
    start = datetime.fromisoformat(whole).replace(tzinfo=UTC)
    return Decimal(int(start.timestamp())) + Decimal(f"0.{decimals or 0}")


@dataclass(frozen=True)
class LineFormat:
    """Format of a log whose frames are lines.

    `mark` matches a line at the start of the log; without it the format is known by its frames.
    `frame` matches a frame and has the groups `time`, `id`, `length`, `data`, and perhaps `bus` and
    `kind`, which contains one of `extended_kinds` for extended identifiers. Without `kind`
    identifiers of more than 11 bits or 8 digits are extended, unless `is_padded`: all have 8.
    """

    name: str
    mark: re.Pattern[str] | None
    frame: re.Pattern[str]
    stamp: Callable[[str], Decimal]
    extended_kinds: str = ""
    is_padded: bool = False


FORMATS = (
    LineFormat(
        "BUSMASTER",
        re.compile(r"\s*\*\*\*BUSMASTER"),
        re.compile(
            r"\s*(?P<time>\d+:\d+:\d+:\d+)\s+[RT]x\s+(?P<bus>\d+)\s+(?:0x)?(?P<id>[0-9A-F]+)\s+"
            rf"(?P<kind>[sx])\s+(?P<length>\d+)\s*{BYTES}",
            re.IGNORECASE,
        ),
        _clock_fraction,
        extended_kinds="xX",
    ),
    LineFormat(
        "Microchip CAN BUS Analyzer",
        re.compile(r"\s*(?:Microchip Technology|CAN BUS Analyzer)"),
        re.compile(
            rf"\s*(?P<time>\d+);[RT]X;0x(?P<id>[0-9A-F]+);(?P<length>\d+);{BYTES}", re.IGNORECASE
        ),
        _milliseconds,
        is_padded=True,
    ),
    LineFormat(
        "CANHacker",
        re.compile(r"\s*@ TEXT @"),
        re.compile(
            r"\s*(?P<time>\d+[.,]\d+)\t(?P<bus>\d+)\t[0-9A-F]+\t(?P<id>[0-9A-F]+)\t(?P<length>\d+)\t"
            r"(?P<data>[0-9A-F ]*)(?:\t.*)?",
            re.IGNORECASE,
        ),
        _seconds,
    ),
    LineFormat(
        "PP2CAN",
        re.compile(r"PP2CAN|CAN speed 1:.*CAN speed 2:"),
        re.compile(
            r"[<>]\t\d+\t\s*(?P<time>\d+:\d+:\d+\.\d+)(?::[\d.]+)?\t(?P<kind>\w+)\t0x(?P<id>[0-9A-F]+)"
            rf"\t\d+\t(?P<length>\d+)\t{BYTES}(?:p:(?P<bus>\d+)\s*)?",
            re.IGNORECASE,
        ),
        _clock_milliseconds,
        extended_kinds="Ee",
    ),
    LineFormat(
        "candump",
        None,
        re.compile(
            r"\s*\((?P<time>\d+\.\d+|\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d+)\)\s+(?P<bus>\w+)\s+"
            r"(?:[RT]X\s+[-BE ]*\s)?(?P<id>[0-9A-F]{1,8})\s+\[\s*(?P<length>\d+)\]\s*"
            rf"{BYTES}(?:'.*')?",
            re.IGNORECASE,
        ),
        _seconds_or_date,
    ),
)
"""Formats of text logs."""


def find_line_format(lines: Sequence[str]) -> LineFormat | None:
    """Return the format of a log by its first lines; None for another one."""
    head = lines[:HEAD_LINES]
    for form in FORMATS:
        pattern = form.mark or form.frame
        if any(pattern.match(line) if form.mark else pattern.fullmatch(line) for line in head):
            return form
    return None


def read_frame_lines(
    form: LineFormat, lines: Sequence[tuple[int, str]]
) -> tuple[list[tuple[int, LoggedFrame]], list[tuple[int, str]]]:
    """Return the frames of the numbered lines of a log, and the lines that are cut frames.

    Other lines are passed over. Raises FrameTextError if the stamps are differences.
    """
    base = _read_modes(form, lines)
    frames: list[tuple[int, LoggedFrame]] = []
    cut: list[tuple[int, str]] = []
    falls = 0
    for number, line in lines:
        match = form.frame.fullmatch(line)
        frame = _parse_frame(form, match, base) if match else None
        if frame is not None:
            falls += bool(frames) and frame.timestamp < frames[-1][1].timestamp
            frames.append((number, frame))
        elif match or _looks_like_frame(form, line):
            cut.append((number, line))
    if frames and falls > len(frames) // 10 + 1:
        reason = f"the time stamps decrease {falls} times: they may be differences"
        help = "log absolute time stamps (`candump -L`, or `candump -ta` on the screen)"
        raise FrameTextError(frames[0][0], reason, help)
    return frames, cut


def _read_modes(form: LineFormat, lines: Sequence[tuple[int, str]]) -> int:
    """Return the base of the numbers of a log of BUSMASTER, whose head states it; else 16."""
    base = 16
    for number, line in lines[:HEAD_LINES] if form.name == "BUSMASTER" else ():
        mode = line.strip().strip("*").upper()
        base = 10 if mode == "DEC" else base
        if mode == "RELATIVE MODE":
            reason = "the time stamps of this log are differences (RELATIVE MODE)"
            raise FrameTextError(number, reason, "log in the system mode or the absolute mode")
    return base


def _looks_like_frame(form: LineFormat, line: str) -> bool:
    """Return whether a line begins like a frame, so that it may be a cut one."""
    start = line.lstrip()[:1]
    return bool(FRAME_START.match(line)) and (form.mark is not None or start == "(")


def _parse_frame(form: LineFormat, match: re.Match[str], base: int) -> LoggedFrame | None:
    """Return the frame of a line; None if its number of bytes is not the stated one."""
    groups = match.groupdict()
    try:
        data = parse_bytes(groups["data"], base)
        identifier = int(groups["id"], base)
        stamp = float(form.stamp(groups["time"]))
    except ValueError:
        return None
    if len(data) != int(groups["length"]) or identifier > MAX_EXTENDED:
        return None
    is_extended = identifier > MAX_STANDARD
    if form.extended_kinds:
        is_extended |= groups["kind"][0] in form.extended_kinds
    elif not form.is_padded:
        is_extended |= len(groups["id"]) == len("1FFFFFFF")
    return LoggedFrame(stamp, bus_name(groups.get("bus") or ""), identifier, is_extended, data)


def decode_text(data: bytes) -> str:
    """Return the text of a log or of a DBC file in UTF-8, UTF-16 with its mark, or Windows-1252."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def parse_bytes(text: str, base: int = 16) -> bytes:
    """Return the bytes of a text, separated by blanks or semicolons, or without separators.

    Raises ValueError for another text.
    """
    words = text.replace(";", " ").replace("0x", " ").replace("0X", " ").split()
    if base == 16 and len(words) == 1 and len(words[0]) > 2:
        return bytes.fromhex(words[0])
    return bytes(int(word, base) for word in words)


def bus_name(text: str) -> str:
    """Return the name of a bus: `CAN1` for the number 1, else the text itself."""
    return f"CAN{int(text)}" if text.isdecimal() else text
