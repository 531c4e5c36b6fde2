"""Recording: the channels of a measured file, each with its own exact time stamps (decision 0038).

`read_recording` reads a file by a recording map; the format follows from the name.
"""

from __future__ import annotations

import dataclasses
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine.recordings.can_log import LOG_SUFFIXES, holds_frames
from engine.recordings.channel_reader import ChannelReader, require_names
from engine.recordings.csv_reader import read_csv
from engine.recordings.recording_file import Assumption, RecordedFile, require_regular_file
from engine.recordings.recording_window import strip_window_suffix, windows_in_use
from language.model.system import ColumnMapping, RecordingMap, Window
from language.overlays.expand_document import display_path
from language.text.diagnostic import Problems, Source, Span
from language.text.sanitise import escape_invisible


@dataclass(frozen=True)
class Channel:
    """Signal with exact, increasing time stamps [s] and values in SI, both (n_samples,).

    `clock` is the column of its time stamps; empty if the file stamps each channel.
    """

    column: ColumnMapping
    times: tuple[Fraction, ...]
    values: tuple[float, ...]
    clock: str = ""

    @cached_property
    def seconds(self) -> NDArray[np.float64]:
        """Time stamps [s] (n_samples,), rounded."""
        return np.array([time.numerator / time.denominator for time in self.times])

    @cached_property
    def array(self) -> NDArray[np.float64]:
        """Values in SI (n_samples,)."""
        return np.array(self.values)

    def slice_samples(self, selection: slice) -> Channel:
        """Return the channel with a slice of its samples; `seconds` and `array` are sliced too."""
        part = Channel(self.column, self.times[selection], self.values[selection], self.clock)
        vars(part).update(seconds=self.seconds[selection], array=self.array[selection])
        return part


@dataclass(frozen=True)
class Recording:
    """Channels that a map takes from a file, by their names in the map.

    `start` and `end` [s] are the first and last time. `windows` [s] are the times to use, in order;
    empty means all. `place` is that of the file, for messages. `assumptions` tell what was taken of
    the file that neither the file nor the map states.
    """

    name: str
    channels: dict[str, Channel]
    end: Fraction
    start: Fraction = Fraction(0)
    windows: tuple[Window, ...] = ()
    place: Span | None = None
    assumptions: tuple[Assumption, ...] = ()

    def is_used(self, time: Fraction) -> bool:
        """Return whether a time [s] lies in a window, ends included; True without windows."""
        return not self.windows or any(start <= time <= end for start, end in self.windows)


def split_by_windows(recording: Recording) -> list[Recording]:
    """Return the recording cropped to each of its windows (`crop`); itself if it has no windows."""
    return [crop(recording, window) for window in recording.windows] or [recording]


def crop(recording: Recording, window: Window) -> Recording:
    """Return the samples of a recording within a window [s], ends included.

    Channels without a sample in the window are left out. `windows` of the result is this window;
    `start` and `end` are its intersection with those of the recording.
    """
    channels = {}
    for name, channel in recording.channels.items():
        first = bisect_left(channel.times, window[0])
        last = bisect_right(channel.times, window[1])
        if first < last:
            channels[name] = channel.slice_samples(slice(first, last))
    start, end = max(window[0], recording.start), min(window[1], recording.end)
    return dataclasses.replace(
        recording, channels=channels, end=end, start=start, windows=(window,)
    )


def read_recording(path: Path, mapping: RecordingMap, used: Sequence[str]) -> Recording:
    """Read the used channels of a file: CSV (also gzipped), Parquet, MDF or a CAN log.

    `used` are names of columns of the map. A path `run.csv@0..12.5` selects the window from 0 s to
    12.5 s. The result is cropped to the windows of the map and the path (`crop_to_windows`); its
    `name` is that of the path. `start` and `end` are those of the shared time column, else of the
    channels. Raises SpecError with all problems, and MissingToolError if a library is not
    installed.
    """
    problems = Problems()
    file = open_recording(path, mapping, problems)
    columns = [mapping.columns[name] for name in used]
    names = [name for column in columns for name in column.columns]
    if not file.is_stamped:
        if not mapping.time:
            label = f"map `{mapping.name}` names no column of time, which this file needs"
            problems.error("missing", mapping.span, label, "`time: {column: t_s, unit: s}`")
            problems.raise_if_errors()
        names = [mapping.time, *names, *[column.time for column in columns if column.time]]
    require_names(file, names, mapping, problems)
    problems.raise_if_errors()
    reader = ChannelReader(file, mapping, problems)
    channels = {
        column.name: Channel(
            column,
            *reader.samples(column),
            clock="" if file.is_stamped else column.time or mapping.time,
        )
        for column in columns
    }
    problems.raise_if_errors()
    _share_seconds(channels.values())
    ends = [*reader.clock[:1], *reader.clock[-1:]]
    if file.is_stamped:
        ends = [t for c in channels.values() for t in (c.times[0], c.times[-1])]
    known = [time for time in ends if time is not None]
    windows = windows_in_use(path, mapping, problems)
    problems.raise_if_errors()
    place = Span(Source(display_path(strip_window_suffix(path))), 1, 1)
    recording = Recording(path.name, channels, max(known), min(known), windows, place)
    assumed = tuple(
        Assumption(*map(escape_invisible, (item.subject, item.value, item.reason)))
        for item in dict.fromkeys(
            (*file.assumptions, *reader.time_reader.assumptions, *reader.assumptions)
        )
    )
    recording = dataclasses.replace(recording, assumptions=assumed)
    return crop_to_windows(recording, mapping)


def _share_seconds(channels: Iterable[Channel]) -> None:
    """Let channels with the same tuple of stamps share one array of seconds."""
    first: dict[int, Channel] = {}
    for channel in channels:
        sampled_together = first.setdefault(id(channel.times), channel)
        vars(channel)["seconds"] = sampled_together.seconds


def open_recording(path: Path, mapping: RecordingMap, problems: Problems) -> RecordedFile:
    """Open a file by its suffix in any case; a time window at the end of the path is ignored.

    `.parquet` is Parquet; `.mf4`, `.mdf`, and `.dat` that starts with `MDF` are MDF; `.blf`,
    `.asc`, `.trc` and `.log` are CAN logs, and so is a text file with frames, if the map names a
    database; all others CSV, whose faulty rows are added to `problems`. Raises SpecError for a
    pipe, a device and a file that cannot be read, and MissingToolError if a library is not
    installed.
    """
    path = strip_window_suffix(path)
    require_regular_file(path, Source(display_path(path)))
    ending = path.suffix.lower()
    if ending == ".parquet":
        from engine.recordings.parquet_reader import read_parquet

        return read_parquet(path)
    if ending in (".mf4", ".mdf") or (ending == ".dat" and _is_mdf(path)):
        from engine.recordings.mdf_reader import read_mdf

        return read_mdf(path, mapping)
    if ending in LOG_SUFFIXES or (mapping.databases and holds_frames(path)):
        from engine.recordings.can_reader import read_can

        return read_can(path, mapping)
    return read_csv(path, mapping, problems)


def _is_mdf(path: Path) -> bool:
    """Return whether a file starts with the bytes of MDF, because `.dat` has several meanings."""
    try:
        with path.open("rb") as file:
            return file.read(3) == b"MDF"
    except OSError:
        return False


def crop_to_windows(recording: Recording, mapping: RecordingMap) -> Recording:
    """Return a recording from the start of its first window to the end of its last one.

    Samples between windows are kept, and so are `windows`; without windows the recording itself is
    returned. Raises SpecError, at the place of the map, for each channel without a value in a
    window.
    """
    if not recording.windows:
        return recording
    problems = Problems()
    for piece in split_by_windows(recording):
        for name in recording.channels.keys() - piece.channels.keys():
            (start, end), *_ = piece.windows
            label = f"`{name}` has no value from {float(start):g} s to {float(end):g} s"
            hint = f"{recording.name} goes from {float(recording.start):g} s to "
            hint += f"{float(recording.end):g} s"
            problems.error("range", mapping.span, label + ", a window of this map", hint)
    problems.raise_if_errors()
    whole = crop(recording, (recording.windows[0][0], recording.windows[-1][1]))
    return dataclasses.replace(whole, windows=recording.windows)
