"""Recording: a measured file as channels, each value with its own exact time stamp."""

from __future__ import annotations

import dataclasses
import itertools
import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine.recorded_csv import DECIMAL, read_csv
from engine.recorded_file import MAX_PROBLEMS, RecordedFile, Samples
from language.experiment import Column, RecordingMap, Window
from language.problem import Problems, Span, nearest
from language.units import UnitError, fits, parse_unit

LONGEST_STAMP = 40
LATEST_TIME = 10**12
"""Time stamps are below this, in their unit."""
OTHER_WORDS = {
    "Nm": "N*m", "1/min": "rpm", "U/min": "rpm", "r/min": "rpm", "kph": "km/h", "m/s2": "m/s^2",
    "\N{DEGREE SIGN}C": "degC", "\N{DEGREE SIGN}": "deg",
}  # fmt: skip
"""Units as loggers and DBC files write them."""


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
    """Read the used channels of a file: CSV (also gzipped), Parquet, MF4 or a log of CAN frames.

    Raises SpecError with all problems, ToolMissing.
    """
    problems = Problems()
    file = open_recorded(path, mapping, problems)
    columns = [mapping.columns[name] for name in used]
    wanted = [name for column in columns for name in column.columns]
    if not file.is_stamped:
        if not mapping.time:
            label = f"map `{mapping.name}` names no column of time, which this file needs"
            problems.error("missing", mapping.span, label, "`time: {column: t_s, unit: s}`")
            problems.stop_if_any()
        wanted = [mapping.time, *wanted, *[column.time for column in columns if column.time]]
    _require(file, wanted, mapping, problems)
    problems.stop_if_any()
    reader = _Reader(file, mapping, problems)
    channels = {column.name: reader.channel(column) for column in columns}
    problems.stop_if_any()
    stamps = reader.clock
    if file.is_stamped:
        stamps = [t for c in channels.values() for t in (c.times[0], c.times[-1])]
    known = [time for time in stamps if time is not None]
    windows = mapping.windows_of(path.name)
    return within(Recording(path.name, channels, max(known), min(known), windows), mapping)


def open_recorded(path: Path, mapping: RecordingMap, problems: Problems) -> RecordedFile:
    """Return what a file holds, by the ending of its name. Raises SpecError, ToolMissing."""
    ending = path.suffix.lower()
    if ending == ".parquet":
        from engine.recorded_parquet import read_parquet

        return read_parquet(path)
    if ending in (".mf4", ".mdf", ".dat"):
        from engine.recorded_mdf import read_mdf

        return read_mdf(path)
    if ending in (".blf", ".asc", ".log"):
        from engine.recorded_can import read_can

        return read_can(path, mapping)
    return read_csv(path, problems)


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


def _require(
    file: RecordedFile, names: Sequence[str], mapping: RecordingMap, problems: Problems
) -> None:
    for name in dict.fromkeys(names):
        count = list(file.names).count(name)
        if not count:
            label = f"there is no {file.noun} `{name}`, which map `{mapping.name}` reads"
            hint = file.lacking(name) or nearest(name, file.names)
            problems.error("column", file.head, label, hint)
        elif count > 1:
            problems.error("column", file.head, f"there are two {file.noun}s `{name}`")
    if not file.rows:
        label = "the recording has a head line and no values"
        if file.is_stamped:
            label = "the recording has no values"
        problems.error("empty", file.head, label)


class _Reader:
    """Channels of a file by a map, with exact time stamps."""

    def __init__(self, file: RecordedFile, mapping: RecordingMap, problems: Problems) -> None:
        self.file = file
        self.mapping = mapping
        self.problems = problems
        self.clock = [] if file.is_stamped else self.times(mapping.time)

    @property
    def is_full(self) -> bool:
        """Tell whether so many problems were found that the rest is not looked at."""
        return len(self.problems.found) >= MAX_PROBLEMS

    def times(self, name: str) -> list[Fraction | None]:
        """Return the time stamps of a column [s]; None where it is blank."""
        samples = self.file.read(name)
        found: list[Fraction | None] = []
        last: Fraction | None = None
        for k in range(len(samples.values)):
            if self.is_full:
                break
            text = samples.text(k)
            value = _exact(text)
            if value is not None:
                value = value * self.mapping.time_unit.factor
            elif name == self.mapping.time or text:
                label = f"the time stamp `{text}` is not a number" if text else "no time stamp"
                self.problems.error("time", samples.place(k), label)
            if value is not None and last is not None and value <= last:
                self._unsorted(text, last, samples.place(k))
            last = value if value is not None else last
            found.append(value)
        return found

    def _unsorted(self, text: str, last: Fraction, place: Span) -> None:
        label = f"the time stamp {text} is not above the one before, {float(last):.9g}"
        hint = "sort the recording, and remove repeated rows"
        self.problems.error("time", place, label, hint)

    def _own(self, column: Column, parts: Sequence[Samples]) -> Sequence[Fraction | None]:
        """Return the stamps that the parts of a column carry themselves."""
        stamps = parts[0].stamps or ()
        if any(part.stamps != stamps for part in parts[1:]):
            label = f"the {self.file.noun}s of `{column.name}` do not have the same time stamps"
            hint = "a mean is taken of values that were measured together"
            self.problems.error("time", column.span, label, hint)
        for k, (before, after) in enumerate(itertools.pairwise(stamps), start=1):
            if after <= before and not self.is_full:
                self._unsorted(f"{float(after):.9g}", before, parts[0].place(k))
        return stamps

    def channel(self, column: Column) -> Channel:
        """Return the channel of a column of the map, its values in SI."""
        parts = [self.file.read(name) for name in column.columns]
        if self.file.is_stamped:
            stamps = self._own(column, parts)
        else:
            stamps = self.times(column.time) if column.time else self.clock
        cells = [
            self._values(name, part, column)
            for name, part in zip(column.columns, parts, strict=True)
        ]
        times: list[Fraction] = []
        kept: list[float] = []
        scale = float(column.scale[0]) * column.sign
        for k, (stamp, *row) in enumerate(zip(stamps, *cells, strict=False)):
            if any(cell is None for cell in row):
                continue
            if stamp is None:
                if column.time and not self.file.read(column.time).text(k):
                    label = f"a value of `{column.name}` without a time stamp"
                    self.problems.error("time", parts[0].place(k), label)
                continue
            value = _mean(row) * scale
            if not math.isfinite(value):
                place = parts[0].place(k)
                self.problems.error("value", place, f"`{column.name}` is {value} in SI")
            times.append(stamp + column.delay)
            kept.append(value)
        if not times and not self.problems.has_errors:
            label = f"{self.file.noun} `{column.columns[0]}` has no values"
            self.problems.error("empty", self.file.head, label)
        return Channel(column, tuple(times), tuple(kept))

    def _values(self, name: str, samples: Samples, column: Column) -> list[float | None]:
        factor, offset = float(column.unit.factor), float(column.unit.offset)
        self._check_unit(name, samples.unit, column)
        found: list[float | None] = []
        for k, value in enumerate(samples.values):
            if self.is_full:
                break
            if value is not None and not math.isfinite(value):
                label = f"`{samples.text(k)}` in {self.file.noun} `{name}` is not a finite number"
                self.problems.error("value", samples.place(k), label)
                value = None
            elif value is None and column.blank == "refuse":
                label = f"{self.file.noun} `{name}` has no value here"
                hint = "`blank: skip` in the map leaves empty cells out"
                self.problems.error("value", samples.place(k), label, hint)
            found.append(None if value is None else value * factor + offset)
        return found

    def _check_unit(self, name: str, written: str, column: Column) -> None:
        """A unit that the file itself gives, where we know it, is that of the map."""
        text = OTHER_WORDS.get(written, written)
        try:
            unit = parse_unit(text)
        except UnitError:
            return
        same = fits(unit.dimension, column.unit.dimension)
        if not same or (unit.factor, unit.offset) != (column.unit.factor, column.unit.offset):
            label = f"the file gives `{name}` in `{text}`, the map in `{column.unit.text}`"
            self.problems.error("unit", column.span, label, f"`unit: {text}` in the map")


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
