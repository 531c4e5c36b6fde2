"""ASC text: the lines of an ASC log in the form that python-can reads.

Lines that look like frames and are damaged are found here, because python-can reads or skips them
without a word.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal
from typing import NamedTuple

from engine.recordings.frame_text import MAX_EXTENDED, MAX_STANDARD
from engine.recordings.recording_file import Assumption

ASC_STAMP = re.compile(r"(\s*)(\d+)([.,])(\d+)(?=\s)", re.ASCII)
"""Pattern of the time stamp at the start of an ASC line."""
ASC_RELATIVE = re.compile(r"\s*base\s+(?:hex|dec)\s+timestamps\s+relative", re.IGNORECASE)
"""Pattern of the ASC header whose stamps are differences to the line before."""
ASC_ABSOLUTE = re.compile(r"\s*base\s+(?:hex|dec)\s+timestamps\s+absolute", re.IGNORECASE)
"""Pattern of the ASC header whose stamps count from the start of the log."""
ASC_FRAME = re.compile(
    r"\s*\d+\.\d+\s+\d+\s+(?P<id>[0-9A-F]+x?)\s+(?P<direction>\S+)\s+(?P<kind>\S+)\s*(?P<rest>.*)",
    re.IGNORECASE | re.ASCII,
)
"""Pattern of an ASC line that looks like a frame of CAN (not of CAN FD)."""
ASC_DIRECTIONS = ("rx", "tx", "txrq")
"""Words for the direction of a frame in ASC, in lower case."""
ASC_BYTES = {True: re.compile(r"[0-9A-F]{2}", re.I), False: re.compile(r"\d{1,3}", re.ASCII)}
"""Pattern of a byte of data in ASC, by whether its numbers are hexadecimal."""
ASC_EVENT = re.compile(
    r"\s*(?://|(?:Begin|End)\s+Trigger|[\d.]+\s+(?:(?:CAN\s+)?\d+\s+)?"
    r"(?:Start of measurement|Statistic:|log\s+(?:direct\s+)?(?:start|stop|trigger)|"
    r"CAN\s+\d+\s+Status|Status:))",
    re.IGNORECASE,
)
"""Pattern of a line of ASC that states what happened to the log or to a bus."""
ASC_FD_EVENT = re.compile(r"\s*[\d.]+\s+CANFD\s+[A-Z]", re.IGNORECASE)
"""Pattern of an ASC line of CAN FD that is no frame, such as the start of the measurement."""
CAN_BYTES = 8
"""Largest number of bytes of data of a frame of CAN."""


class BadLine(NamedTuple):
    """Line of a text log that is no complete frame, with the reason."""

    number: int
    text: str
    reason: str


def check_asc(
    lines: Sequence[tuple[int, str]], bad: list[BadLine], assumed: list[Assumption]
) -> list[tuple[int, str]]:
    """Return the lines of an ASC log with absolute stamps and decimal points; both are noted.

    Relative stamps are differences to the line before (also to lines that are no frames). Lines of
    CAN FD that are no frames are left out, because python-can fails at them. Frames whose data are
    not as long as stated are added to `bad`, because python-can reads them.
    """
    head = [line for _, line in lines if is_asc_header(line)]
    is_relative = any(ASC_RELATIVE.match(line) for line in head)
    is_hexadecimal = not any(re.match(r"\s*base\s+dec", line, re.IGNORECASE) for line in head)
    has_comma, now = False, Decimal(0)
    result = []
    for number, line in lines:
        match = ASC_STAMP.match(line)
        if match:
            stamp = Decimal(f"{match[2]}.{match[4]}")
            now = now + stamp if is_relative else stamp
            has_comma = has_comma or match[3] == ","
            line = f"{match[1]}{now:f}{line[match.end() :]}"
        if not _is_whole_asc(line, is_hexadecimal):
            bad.append(BadLine(number, line, "is no complete frame"))
        elif not ASC_FD_EVENT.match(line):
            result.append((number, line))
    if not is_relative and not any(ASC_ABSOLUTE.match(line) for line in head):
        reason = "the header does not state whether they are absolute or relative"
        assumed.append(Assumption("time stamps", "absolute", reason))
    if is_relative:
        reason = "the header states relative time stamps"
        assumed.append(Assumption("time stamps", "added to those of the lines before", reason))
    if has_comma:
        assumed.append(Assumption("decimal sign", "comma", "the form of the time stamps"))
    return result


def _is_whole_asc(line: str, is_hexadecimal: bool) -> bool:
    """Return whether a line is a complete frame of CAN, or does not look like one."""
    match = ASC_FRAME.match(line)
    if match is None:
        return True
    direction, kind = match["direction"].lower(), match["kind"].lower()
    if not direction.startswith(("rx", "tx")) and kind not in ("d", "r"):
        return True
    is_known = direction in ASC_DIRECTIONS and kind in ("d", "r")
    if not is_known or _parse_identifier(match["id"], is_hexadecimal) is None:
        return False
    length, *words = match["rest"].split() or [""]
    if kind == "r":
        return True
    if not re.fullmatch(r"[0-9A-Fa-f]", length):
        return False
    count, byte = min(int(length, 16), CAN_BYTES), ASC_BYTES[is_hexadecimal]
    data, behind = words[:count], words[count : count + 1]
    return (
        len(data) == count
        and all(byte.fullmatch(word) for word in data)
        and not any(word[0].isdigit() or byte.fullmatch(word) for word in behind)
    )


def _parse_identifier(text: str, is_hexadecimal: bool) -> int | None:
    """Return the identifier of a frame in ASC (`x` marks an extended one); None for a wrong one."""
    is_extended = text.lower().endswith("x")
    digits = text[:-1] if is_extended else text
    if not is_hexadecimal and not digits.isdecimal():
        return None
    number = int(digits, 16 if is_hexadecimal else 10) if len(digits) <= 10 else MAX_EXTENDED + 1
    return number if number <= (MAX_EXTENDED if is_extended else MAX_STANDARD) else None


def complete_asc_header(
    header: Sequence[tuple[int, str]], assumed: list[Assumption]
) -> list[tuple[int, str]]:
    """Return the header of an ASC log with its last line, which python-can expects.

    Without that line it would skip the first frame. A header without the base is noted.
    """
    if not any(re.match(r"\s*base\s", line, re.IGNORECASE) for _, line in header):
        reason = "the header does not state the base"
        assumed.append(Assumption("numbers", "hexadecimal", reason))
    parts = [one for one in header if "events" not in one[1].lower()]
    return [*parts, (0, "internal events logged")]


def is_asc_header(line: str) -> bool:
    """Return whether a line of an ASC log belongs to its header: it states date, base or events."""
    return bool(
        re.match(r"\s*(?:date\s|base\s+(?:hex|dec)|(?:no\s*)?internal\s+events)", line, re.I)
    )
