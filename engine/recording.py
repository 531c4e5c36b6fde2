"""Recording: a measured file as channels, each value with its own exact time stamp."""

from __future__ import annotations

import csv
import dataclasses
import gzip
import io
import math
import re
import zlib
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from language.experiment import Column, RecordingMap, Window
from language.problem import Problems, Source, Span, nearest
from language.project import shown

MAX_BYTES = 512 * 1024 * 1024
"""Largest recording read, unpacked."""
DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
LONGEST_STAMP = 40
LATEST_TIME = 10**12
"""Time stamps are below this, in their unit."""
MAX_PROBLEMS = 20
"""After so many problems of values the rest is not looked at."""


@dataclass(frozen=True)
class Channel:
    """One signal: time stamps [s], exact and increasing, and values in SI, both (n_samples,)."""

    column: Column
    times: tuple[Fraction, ...]
    values: tuple[float, ...]

    @cached_property
    def seconds(self) -> NDArray[np.float64]:
        """Time stamps [s] (n_samples,), rounded."""
        return np.array([float(time) for time in self.times])

    @cached_property
    def array(self) -> NDArray[np.float64]:
        """Values in SI (n_samples,)."""
        return np.array(self.values)


@dataclass(frozen=True)
class Recording:
    """The channels that a map takes from a file, by the name in the map.

    `windows` [s] are the times to use, in order; where there is none, all is used.
    """

    name: str
    channels: dict[str, Channel]
    end: Fraction
    start: Fraction = Fraction(0)
    windows: tuple[Window, ...] = ()

    def uses(self, time: Fraction) -> bool:
        """Tell whether a time [s] is in one of the windows."""
        return not self.windows or any(start <= time <= end for start, end in self.windows)


def pieces(recording: Recording) -> list[Recording]:
    """Return a recording as one for each of its windows."""
    return [cut(recording, window) for window in recording.windows] or [recording]


def cut(recording: Recording, window: Window) -> Recording:
    """Return what a recording has in a window; a channel without a value there is left out."""
    channels = {}
    for name, channel in recording.channels.items():
        first = bisect_left(channel.times, window[0])
        last = bisect_right(channel.times, window[1])
        if first < last:
            cut = slice(first, last)
            channels[name] = Channel(channel.column, channel.times[cut], channel.values[cut])
    start, end = max(window[0], recording.start), min(window[1], recording.end)
    return Recording(recording.name, channels, end, start, (window,))


def read_recording(path: Path, mapping: RecordingMap, used: Sequence[str]) -> Recording:
    """Read the used channels of a CSV file (also gzipped). Raises SpecError with all problems."""
    source = Source(shown(path))
    lines = _read_lines(path, source)
    source = Source(source.name, tuple(lines))
    problems = Problems()
    rows = _Rows(source, problems)
    columns = [mapping.columns[name] for name in used]
    wanted = [name for column in columns for name in column.columns]
    wanted += [column.time for column in columns if column.time]
    rows.require([mapping.time, *wanted], mapping, problems)
    problems.stop_if_any()
    clock = rows.times(mapping.time, mapping, problems)
    channels = {}
    for column in columns:
        channels[column.name] = rows.channel(column, clock, mapping, problems)
    problems.stop_if_any()
    stamps = [time for time in clock if time is not None]
    windows = mapping.windows_of(path.name)
    return within(Recording(path.name, channels, max(stamps), min(stamps), windows), mapping)


def within(recording: Recording, mapping: RecordingMap) -> Recording:
    """Return a recording from the start of its first window to the end of its last one.

    Raises SpecError for a window in which a channel has no value.
    """
    if not recording.windows:
        return recording
    problems = Problems()
    for piece in pieces(recording):
        for name in recording.channels.keys() - piece.channels.keys():
            (start, end), *_ = piece.windows
            label = f"`{name}` has no value from {float(start):g} s to {float(end):g} s"
            hint = f"{recording.name} goes from {float(recording.start):g} s to "
            hint += f"{float(recording.end):g} s"
            problems.error("range", mapping.span, label + ", a window of this map", hint)
    problems.stop_if_any()
    whole = cut(recording, (recording.windows[0][0], recording.windows[-1][1]))
    return dataclasses.replace(whole, windows=recording.windows)


def _read_lines(path: Path, source: Source) -> list[str]:
    problems = Problems()
    place = Span(source, 1, 1)
    text = ""
    try:
        if path.stat().st_size > MAX_BYTES:
            problems.error("huge", place, f"the recording is larger than {MAX_BYTES} bytes")
            problems.stop_if_any()
        data = path.read_bytes()
        if path.suffix == ".gz":
            data = gzip.GzipFile(fileobj=io.BytesIO(data)).read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            problems.error("huge", place, f"the recording is larger than {MAX_BYTES} bytes")
            problems.stop_if_any()
        text = data.decode("utf-8-sig")
    except OSError as error:
        reason = error.strerror or str(error)
        problems.error("unreadable", place, f"the recording cannot be read: {reason}")
    except (zlib.error, EOFError) as error:
        problems.error("unreadable", place, f"the recording cannot be unpacked: {error}")
    except UnicodeDecodeError:
        problems.error("binary", place, "this is not a text file", "a recording is CSV, or CSV.gz")
    problems.stop_if_any()
    if "\0" in text:
        problems.error("binary", place, "this is not a text file", "a recording is CSV, or CSV.gz")
    elif not text.strip():
        problems.error("empty", place, "the recording is empty")
    problems.stop_if_any()
    return text.splitlines()


class _Rows:
    """The cells of a CSV text, each with its place."""

    def __init__(self, source: Source, problems: Problems) -> None:
        self.source = source
        self.head: list[str] = []
        self.rows: list[tuple[int, list[str]]] = []
        for number, line in enumerate(source.lines, start=1):
            if not line.strip():
                continue
            row = self._cells_of(number, line, problems)
            if not self.head:
                self.head = [cell.strip() for cell in row]
            elif len(row) != len(self.head):
                label = f"this row has {len(row)} cells, the head line has {len(self.head)}"
                hint = "a recording is separated by commas, with decimal points"
                problems.error("row", Span(source, number, 1, len(line)), label, hint)
            else:
                self.rows.append((number, row))
            if len(problems.found) >= MAX_PROBLEMS:
                break

    def _cells_of(self, number: int, line: str, problems: Problems) -> list[str]:
        try:
            return next(csv.reader([line], strict=True))
        except csv.Error as error:
            problems.error("row", Span(self.source, number, 1, len(line)), f"not CSV: {error}")
            return [""] * len(self.head)

    def require(self, names: Sequence[str], mapping: RecordingMap, problems: Problems) -> None:
        head = Span(self.source, 1, 1, max(1, len(self.source.lines[0])))
        for name in dict.fromkeys(names):
            if name not in self.head:
                label = f"there is no column `{name}`, which map `{mapping.name}` reads"
                problems.error("column", head, label, nearest(name, self.head))
            elif self.head.count(name) > 1:
                problems.error("column", head, f"there are two columns `{name}`")
        if not self.rows:
            problems.error("empty", head, "the recording has a head line and no values")

    def cells(self, name: str) -> Iterator[tuple[int, list[str], int, str]]:
        """Yield line, row, position and text of every cell of a column."""
        position = self.head.index(name)
        for line, row in self.rows:
            yield line, row, position, row[position].strip() if position < len(row) else ""

    def span(self, line: int, row: Sequence[str], position: int) -> Span:
        column = 1 + sum(len(cell) + 1 for cell in row[:position])
        width = len(row[position]) if position < len(row) else 1
        return Span(self.source, line, column, max(1, width))

    def times(self, name: str, mapping: RecordingMap, problems: Problems) -> list[Fraction | None]:
        """Return the time stamps of a column [s]; None where it is blank."""
        found: list[Fraction | None] = []
        last: Fraction | None = None
        main = name == mapping.time
        for line, row, position, text in self.cells(name):
            if len(problems.found) >= MAX_PROBLEMS:
                break
            value = _exact(text)
            if value is not None:
                value = value * mapping.time_unit.factor
            elif main or text:
                label = f"the time stamp `{text}` is not a number" if text else "no time stamp"
                problems.error("time", self.span(line, row, position), label)
            if value is not None and last is not None and value <= last:
                label = f"the time stamp {text} is not above the one before, {float(last):.9g}"
                hint = "sort the recording, and remove repeated rows"
                problems.error("time", self.span(line, row, position), label, hint)
            last = value if value is not None else last
            found.append(value)
        return found

    def channel(
        self,
        column: Column,
        clock: list[Fraction | None],
        mapping: RecordingMap,
        problems: Problems,
    ) -> Channel:
        stamps = self.times(column.time, mapping, problems) if column.time else clock
        values = [self._values(name, column, problems) for name in column.columns]
        times: list[Fraction] = []
        kept: list[float] = []
        scale = float(column.scale[0]) * column.sign
        for (number, row), stamp, *cells in zip(self.rows, stamps, *values, strict=False):
            if any(cell is None for cell in cells):
                continue
            place = self.span(number, row, self.head.index(column.columns[0]))
            if stamp is None:
                if column.time and not row[self.head.index(column.time)].strip():
                    label = f"a value of `{column.name}` without a time stamp"
                    problems.error("time", place, label)
                continue
            value = _mean(cells) * scale
            if not math.isfinite(value):
                problems.error("value", place, f"`{column.name}` is {value} in SI")
            times.append(stamp + column.delay)
            kept.append(value)
        if not times and not problems.has_errors:
            place = Span(self.source, 1, 1, max(1, len(self.source.lines[0])))
            problems.error("empty", place, f"column `{column.columns[0]}` has no values")
        return Channel(column, tuple(times), tuple(kept))

    def _values(self, name: str, column: Column, problems: Problems) -> list[float | None]:
        factor, offset = float(column.unit.factor), float(column.unit.offset)
        found: list[float | None] = []
        for line, row, position, text in self.cells(name):
            if len(problems.found) >= MAX_PROBLEMS:
                break
            value = _real(text)
            if text and (value is None or not math.isfinite(value)):
                label = f"`{text}` in column `{name}` is not a finite number"
                problems.error("value", self.span(line, row, position), label)
                value = None
            elif not text and column.blank == "refuse":
                label = f"column `{name}` has no value here"
                hint = "`blank: skip` in the map leaves empty cells out"
                problems.error("value", self.span(line, row, position), label, hint)
            found.append(None if value is None else value * factor + offset)
        return found


def _mean(cells: Sequence[float | None]) -> float:
    total = 0.0
    for cell in cells:
        total += cell or 0.0
    return total / len(cells)


def _exact(text: str) -> Fraction | None:
    if len(text) > LONGEST_STAMP or not DECIMAL.fullmatch(text):
        return None
    value = Fraction(text)
    return value if abs(value) < LATEST_TIME else None


def _real(text: str) -> float | None:
    return float(text) if DECIMAL.fullmatch(text) else None
