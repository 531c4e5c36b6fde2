"""CAN log: reads the frames of a log (candump, ASC, TRC, BLF and others) by bus and identifier.

The lines of a text log are checked first, because python-can ends at the first line that it cannot
parse. Lines that are no complete frames are left out and told. Logs that python-can does not know
are read by their form, whatever their suffix is.
"""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from engine.recordings.asc_text import (
    ASC_EVENT,
    BadLine,
    check_asc,
    complete_asc_header,
    is_asc_header,
)
from engine.recordings.frame_table import (
    find_frame_table,
    propose_time_unit,
    read_frame_table,
)
from engine.recordings.frame_text import (
    HEAD_LINES,
    FrameTextError,
    decode_text,
    find_line_format,
    read_frame_lines,
)
from engine.recordings.recording_file import Assumption, first_line, unreadable_error
from language.model.system import RecordingMap
from language.text.diagnostic import Problem, Source, Span, SpecError

LOG_SUFFIXES = (".blf", ".asc", ".log", ".trc")
"""Suffixes of logs of CAN frames."""
TEXT_SUFFIXES = (".csv", ".txt")
"""Suffixes of text files that may contain frames, if the map names a database."""
CANDUMP_LINE = re.compile(
    r"\s*\(\d+(?:\.\d+)?\)\s+\S+\s+(?P<id>[0-9A-F]{3}|[0-9A-F]{8})#"
    r"(?:#[0-9A-F](?:[0-9A-F]{2}){0,64}|(?:[0-9A-F]{2}){0,8}|R[0-9A-F]?)(?:\s+[RT])?\s*",
    re.IGNORECASE | re.ASCII,
)
"""Pattern of a frame that `candump -L` writes."""
CANDUMP_ERROR_FLAG = 0x20000000
"""Bit of the identifier of an error frame in a candump log."""
CANDUMP_SCREEN = re.compile(r"\s*\w+\s+[0-9A-F]+\s+\[\d+\]", re.IGNORECASE)
"""Pattern of a line without time stamp that candump writes to the screen."""
TRC_FRAME = re.compile(
    r"\s*\d+\)?\s+[\d.]+\s+"
    r"(?:(?:\d+\s+)?(?:Rx|Tx|DT|FD|FB|FE|BI)\s|(?!FFFFFFFF)[0-9A-F]{4,8}\s+\d)"
)
"""Pattern of the start of a frame in a TRC log."""
TRC_VERSIONS = "1.0, 1.1, 1.3, 2.0 and 2.1"
"""Versions of TRC that python-can reads."""
HEAD_BYTES = 8192
"""Number of bytes at the start of a file that show whether it contains frames."""
MAX_SHOWN = 60
"""Number of characters of a line that a message shows."""


class FrameKey(NamedTuple):
    """Name of the bus (empty if the log has none), identifier, and whether it is extended."""

    bus: str
    identifier: int
    is_extended: bool


class CanFrame(NamedTuple):
    """Time stamp [s] and data of a frame, and its line in a text log, else its number."""

    time: float
    data: bytes
    line: int


@dataclass(frozen=True)
class CanLog:
    """Data frames of a log by their keys, and what is left out or assumed."""

    frames: dict[FrameKey, list[CanFrame]]
    assumptions: tuple[Assumption, ...] = ()


def read_can_log(path: Path, source: Source, can: Any, mapping: RecordingMap) -> CanLog:
    """Return the data frames of a log; error and remote frames are left out.

    `can` is the package python-can. A frame that repeats the one before (same bus, identifier,
    time stamp and data) is left out. The map states the unit of time of a table of frames. Raises
    SpecError if the log has no data frame, or more lines that cannot be understood than frames.
    """
    logging.getLogger("can").setLevel(logging.CRITICAL)
    suffix = path.suffix.lower()
    assumed: list[Assumption] = []
    if suffix == ".blf":
        numbered = _read_binary(path, source, can, assumed)
    else:
        numbered = _read_text(path, source, can, mapping, assumed)
    frames: dict[FrameKey, list[CanFrame]] = {}
    unstamped: list[int] = []
    for line, frame in numbered:
        if not math.isfinite(frame.timestamp):
            unstamped.append(line)
        elif not (frame.is_error_frame or frame.is_remote_frame):
            bus = _bus_name(frame.channel, suffix)
            key = FrameKey(bus, frame.arbitration_id, frame.is_extended_id)
            found = CanFrame(frame.timestamp, bytes(frame.data), line)
            frames.setdefault(key, []).append(found)
    if unstamped:
        reason = f"the time stamp of line {unstamped[0]} is not a finite number"
        assumed.append(Assumption("frames", f"{len(unstamped)} left out", reason))
    if not frames:
        label = "the log has no data frame of a CAN bus"
        if numbered:
            label += ": it has only error frames and remote frames"
        raise SpecError([Problem("empty", Span(source, 1, 1), label)])
    return CanLog(remove_repeated_frames(frames, assumed), tuple(assumed))


def remove_repeated_frames(
    frames: dict[FrameKey, list[CanFrame]], assumed: list[Assumption]
) -> dict[FrameKey, list[CanFrame]]:
    """Return the frames without those that repeat the stamp and data of the one before.

    A logger that records sent and received frames writes such pairs. A note gives their number.
    """
    result, count = {}, 0
    for key, series in frames.items():
        last = [None, *series[:-1]]
        kept = [f for f, before in zip(series, last, strict=True) if not _repeats(f, before)]
        count += len(series) - len(kept)
        result[key] = kept
    if count:
        value = f"{count} of {sum(map(len, frames.values()))} left out"
        reason = "they repeat the time stamp and the data of the frame before"
        assumed.append(Assumption("frames", value, reason))
    return result


def _repeats(frame: CanFrame, before: CanFrame | None) -> bool:
    """Return whether a frame has the time stamp and the data of the one before."""
    return before is not None and frame[:2] == before[:2]


def _bus_name(channel: Any, suffix: str) -> str:
    """Return the name of a bus as the log shows it: `can0`, or `CAN1` for the number 1.

    python-can counts the channels of ASC and BLF from 0.
    """
    if channel is None or isinstance(channel, str):
        return channel or ""
    return f"CAN{channel + (suffix in ('.asc', '.blf'))}"


def _read_binary(
    path: Path, source: Source, can: Any, assumed: list[Assumption]
) -> list[tuple[int, Any]]:
    """Return the numbered frames of a BLF file up to its first error or its cut end.

    Both are noted. Raises SpecError if there is no frame before the error.
    """
    frames: list[tuple[int, Any]] = []
    try:
        with can.BLFReader(str(path)) as log:
            frames.extend(enumerate(log, start=1))
            size, stated = path.stat().st_size, log.file_size
        if size < stated:
            reason = f"the log has {size} of {stated} bytes"
            assumed.append(Assumption("end of the log", "left out", reason))
    except Exception as error:  # the library raises errors of any type for a broken file
        if not frames:
            action = "understood as a log of CAN frames: it is no BLF file, or it is damaged"
            raise unreadable_error(source, action) from None
        value = f"all behind frame {len(frames)} left out"
        assumed.append(Assumption("frames", value, f"the log is damaged: {first_line(error)}"))
    return frames


def holds_frames(path: Path) -> bool:
    """Return whether a text file (`TEXT_SUFFIXES`) contains CAN frames in a form that is read.

    A file that cannot be read contains none.
    """
    if path.suffix.lower() not in TEXT_SUFFIXES:
        return False
    try:
        with path.open("rb") as file:
            lines = decode_text(file.read(HEAD_BYTES)).splitlines()
    except OSError:
        return False
    is_candump = any(CANDUMP_LINE.fullmatch(line) for line in lines[:HEAD_LINES])
    return is_candump or bool(find_frame_table(lines) or find_line_format(lines))


def propose_frame_time(path: Path) -> tuple[str, str, str] | None:
    """Return the time column of a text with a table of frames, its unit and the reason.

    The result is None for another file, and if the unit does not follow from the rate of frames.
    """
    if path.suffix.lower() not in (*TEXT_SUFFIXES, ".log"):
        return None
    return propose_time_unit(decode_text(path.read_bytes()).splitlines())


def _read_text(
    path: Path, source: Source, can: Any, mapping: RecordingMap, assumed: list[Assumption]
) -> list[tuple[int, Any]]:
    """Return the frames of a text log with the numbers of their lines. Raises SpecError."""
    text = decode_text(path.read_bytes())
    lines = list(enumerate(text.splitlines(), start=1))
    bad: list[BadLine] = []
    suffix = path.suffix.lower()
    frames = _read_other_form(source, text, lines, mapping, bad, assumed)
    if frames is not None:
        suffix = ""
    else:
        suffix = suffix if suffix in LOG_SUFFIXES else ".log"
        frames = _read_known_form(suffix, text, lines, can, bad, assumed)
    bad.sort()
    if len(bad) > len(frames) or not frames:
        raise _no_log_error(source, suffix, lines, bad)
    if bad:
        first = bad[0]
        reason = f"line {first.number} {first.reason}: `{_crop(first.text)}`"
        assumed.append(Assumption("lines", f"{len(bad)} left out", reason))
    return frames


def _read_other_form(
    source: Source,
    text: str,
    lines: list[tuple[int, str]],
    mapping: RecordingMap,
    bad: list[BadLine],
    assumed: list[Assumption],
) -> list[tuple[int, Any]] | None:
    """Return the frames of a log that python-can does not read; None for another log.

    Raises SpecError if the time stamps of the log cannot be used.
    """
    written = [line for _, line in lines]
    if any(CANDUMP_LINE.fullmatch(line) for line in written[:HEAD_LINES]):
        return None
    form, table = find_line_format(written), find_frame_table(written)
    if form is None and table is None:
        return None
    _drop_cut_line(text, lines, bad)
    try:
        if table is None or form is not None:
            assert form is not None
            frames, cut = read_frame_lines(form, lines)
        else:
            body = lines[table.line :]
            time, unit = mapping.time, mapping.time_unit
            frames, cut = read_frame_table(table, body, time, unit, mapping.date_order)
            assumed += table.assumptions
    except FrameTextError as error:
        span = Span(source, error.line, 1)
        raise SpecError([Problem("time", span, str(error), error.help)]) from None
    bad += [BadLine(number, line, "is no complete frame") for number, line in cut]
    return frames


def _read_known_form(
    suffix: str,
    text: str,
    lines: list[tuple[int, str]],
    can: Any,
    bad: list[BadLine],
    assumed: list[Assumption],
) -> list[tuple[int, Any]]:
    """Return the frames of a log of a form (`LOG_SUFFIXES`) that python-can reads."""
    is_header: Callable[[str], bool] = _is_trc_header
    if suffix != ".log":
        _drop_cut_line(text, lines, bad)
    if suffix == ".log":  # it has no header
        reader, is_header = can.CanutilsLogReader, lambda _: False
        checked = _check_candump(lines, bad)
    elif suffix == ".asc":
        reader, is_header = can.ASCReader, is_asc_header
        checked = check_asc(lines, bad, assumed)
    else:
        reader, checked = can.TRCReader, lines
    header = [(number, line) for number, line in checked if is_header(line)]
    body = [(number, line) for number, line in checked if not is_header(line)]
    if suffix == ".asc":
        header = complete_asc_header(header, assumed)
    skipped: list[tuple[int, str]] = []
    frames = list(_parse_lines(reader, header, body, bad, skipped))
    if frames and skipped:
        number, line = skipped[0]
        reason = f"they are no frames of a CAN bus; line {number}: `{_crop(line)}`"
        assumed.append(Assumption("other lines", f"{len(skipped)} left out", reason))
    return frames


def _check_candump(lines: Iterable[tuple[int, str]], bad: list[BadLine]) -> list[tuple[int, str]]:
    """Return the complete lines of a candump log without error frames; others are added to `bad`.

    python-can takes a half byte at the end of a cut line as a whole one, and the error frames of
    most classes as data frames.
    """
    result = []
    for number, line in lines:
        match = CANDUMP_LINE.fullmatch(line)
        if match:
            if not int(match["id"], 16) & CANDUMP_ERROR_FLAG:
                result.append((number, line))
        elif line.strip():
            bad.append(BadLine(number, line, "is no complete frame"))
    return result


def _drop_cut_line(text: str, lines: list[tuple[int, str]], bad: list[BadLine]) -> None:
    """Move a last line that begins with a number and has no line break from `lines` to `bad`.

    Its last byte may be cut.
    """
    if lines and not text.endswith(("\n", "\r")) and lines[-1][1].lstrip()[:1].isdigit():
        number, line = lines.pop()
        bad.append(BadLine(number, line, "may be cut, because it has no line break"))


def _is_trc_header(line: str) -> bool:
    """Return whether a line of a TRC log belongs to its header or is a comment."""
    return line.lstrip().startswith(";")


class _LineFeed:
    """Text file of numbered lines; `number` is that of the line that was read last."""

    def __init__(self, lines: Iterable[tuple[int, str]]) -> None:
        self.lines = iter(lines)
        self.number = 0

    def __iter__(self) -> Iterator[str]:
        """Return the feed itself: reading continues at the next line."""
        return self

    def __next__(self) -> str:
        """Return the next line."""
        self.number, line = next(self.lines)
        return line + "\n"

    def close(self) -> None:
        """Do nothing: the lines are in memory."""


def _parse_lines(
    reader: Callable[[Any], Any],
    header: Sequence[tuple[int, str]],
    body: Sequence[tuple[int, str]],
    bad: list[BadLine],
    skipped: list[tuple[int, str]],
) -> Iterator[tuple[int, Any]]:
    """Yield the frames of a text log with the numbers of their lines.

    The reader of python-can starts again, with the header, behind each line at which it fails;
    these lines are added to `bad`, and so are frames of TRC that it skips. Other lines that it
    skips are added to `skipped`, without events of the log (`ASC_EVENT`).
    """
    texts = {number: line for number, line in (*header, *body)}
    positions = {number: k for k, (number, _) in enumerate(body)}
    read: set[int] = set()
    start = 0
    while start < len(body):
        feed = _LineFeed(chain(header, (body[k] for k in range(start, len(body)))))
        try:
            for frame in reader(feed):
                read.add(feed.number)
                yield feed.number, frame
            start = len(body)
        except Exception:  # the library raises errors of any type for a broken line
            failed = feed.number
            bad.append(BadLine(failed, texts[failed], "is no complete frame"))
            read.add(failed)
            start = positions.get(failed, len(body)) + 1
    for number, line in body:
        if number in read or not line.strip():
            continue
        if TRC_FRAME.match(line):
            bad.append(BadLine(number, line, "is no complete frame"))
        elif not ASC_EVENT.match(line):
            skipped.append((number, line))


def _no_log_error(
    source: Source, suffix: str, lines: Sequence[tuple[int, str]], bad: Sequence[BadLine]
) -> SpecError:
    """Return the error for a text log without frames, at its first line that is no frame.

    `suffix` is that of a form that python-can reads, else empty.
    """
    data = [one for one in lines if one[1].strip() and not one[1].lstrip().startswith((";", "//"))]
    number, line = (bad[0].number, bad[0].text) if bad else (data or [(1, "")])[-1]
    label = "this is no log of CAN frames"
    help = {
        ".log": "a line of `candump -L` is `(1700000000.000000) can0 100#0F00000064010000`",
        ".asc": "a line of a frame is `0.010000 1  100  Rx   d 8 0F 00 00 00 64 01 00 00`",
        ".trc": f"the versions {TRC_VERSIONS} of TRC are read; the file names its own in "
        "`;$FILEVERSION=`",
        "": "a row or line has a time, an identifier, and as many bytes as it states",
    }[suffix]
    if suffix == ".log" and CANDUMP_SCREEN.match(line):
        label = "the frames have no time stamps: this is what `candump` writes to the screen"
        help = "`candump -L` or `candump -l` write a log"
    if suffix == ".log" and not bad:
        label, help = "the log has no data frames", ""
    elif line.strip():
        label += f": `{_crop(line)}`"
    return SpecError([Problem("unreadable", Span(source, number, 1), label, help)])


def _crop(line: str) -> str:
    """Return the first `MAX_SHOWN` characters of a line without outer blanks."""
    text = line.strip()
    return text if len(text) <= MAX_SHOWN else text[:MAX_SHOWN] + "..."
