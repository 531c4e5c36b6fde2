"""CAN reader: decodes the frames of a log (candump, ASC, BLF) with the DBC files of the map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from engine.recordings.recording_file import (
    RecordedFile,
    Samples,
    exact_fraction,
    require_size,
    unreadable_error,
)
from language.model.system import RecordingMap
from language.overlays.expand_document import display_path
from language.text.diagnostic import MissingToolError, Problem, Problems, Source, Span, SpecError
from language.text.project_boundary import path_exists, project_root_of, require_inside_project
from language.text.regular_file import open_regular_file

DATABASE_SUFFIXES = (".dbc", ".arxml", ".kcd", ".sym")
"""Suffixes of files that describe CAN messages; the first is suggested."""
CanFrame = tuple[float, bytes]
"""Time stamp [s] and data of a frame."""
FrameKey = tuple[int, bool]
"""Identifier of a frame, and whether it is an extended one."""


def read_can(path: Path, mapping: RecordingMap) -> RecordedFile:
    """Read a log of CAN frames (`.blf`, `.asc`, `.log`) with the databases of the map.

    Names are the signals of messages that occur in the log, both as `signal` and `message.signal`;
    a `signal` of several such messages occurs once for each of them and cannot be read. Error and
    remote frames are left out. Raises SpecError if a file cannot be read or understood, the log is
    empty or too large, or the map names no database; MissingToolError without python-can or
    cantools. A signal is decoded when it is read, which raises SpecError for a frame that does not
    fit its message.
    """
    source = Source(display_path(path))
    require_size(path, source)
    try:
        import can
        import cantools
    except ImportError:
        raise MissingToolError(
            "a log of CAN frames needs the packages `python-can` and `cantools`: "
            "pip install 'modewright[can]'"
        ) from None
    if not mapping.databases:
        label = f"map `{mapping.name}` names no DBC, which a log of CAN frames needs"
        raise SpecError([Problem("missing", mapping.span, label, "`dbc: vehicle.dbc` in the map")])
    messages = _read_databases(mapping, cantools)
    frames = _read_frames(path, source, can)
    return _CanLog(source, messages, frames).to_recorded_file()


def _read_databases(mapping: RecordingMap, cantools: Any) -> dict[FrameKey, Any]:
    """Return the messages of the databases of a map by frame key. Raises SpecError.

    A database is searched relative to the map, then to the working directory, and has to lie inside
    the project.
    """
    problems = Problems()
    messages: dict[FrameKey, Any] = {}
    for written in mapping.databases:
        folders = (Path(written.span.source.name).parent, Path())
        paths = [folder / written.text for folder in folders if path_exists(folder / written.text)]
        if not paths:
            problems.error("unreadable", written.span, f"there is no file `{written.text}`")
            continue
        if paths[0].suffix.lower() not in DATABASE_SUFFIXES:
            label = f"`{written.text}` is not a DBC file by its name"
            problems.error(
                "unreadable", written.span, label, f"it ends with {DATABASE_SUFFIXES[0]}"
            )
            continue
        with problems.collect_errors():
            require_inside_project(
                paths[0], written.span, project_root_of(Path(written.span.source.name))
            )
            try:
                open_regular_file(paths[0]).close()  # raises OSError for a pipe
                database = cantools.database.load_file(paths[0])
                messages |= {(m.frame_id, m.is_extended_frame): m for m in database.messages}
            except Exception as error:  # the library raises errors of any type for a broken file
                label = f"`{written.text}` cannot be understood: {_first_line(error)}"
                problems.error("unreadable", written.span, label)
    problems.raise_if_errors()
    return messages


def _read_frames(path: Path, source: Source, can: Any) -> dict[FrameKey, list[CanFrame]]:
    """Return the data frames of a log by frame key; error and remote frames are skipped.

    Raises SpecError if the log cannot be understood.
    """
    readers = {".blf": can.BLFReader, ".asc": can.ASCReader, ".log": can.CanutilsLogReader}
    frames: dict[FrameKey, list[CanFrame]] = {}
    try:
        with readers[path.suffix.lower()](str(path)) as log:
            for frame in log:
                if not (frame.is_error_frame or frame.is_remote_frame):
                    key = (frame.arbitration_id, frame.is_extended_id)
                    frames.setdefault(key, []).append((frame.timestamp, bytes(frame.data)))
    except Exception as error:  # the library raises errors of any type for a broken file
        raise unreadable_error(
            source, f"understood as a log of CAN frames: {_first_line(error)}"
        ) from None
    return frames


class _CanLog:
    """Frames of a log with the messages that decode them."""

    def __init__(
        self, source: Source, messages: dict[FrameKey, Any], frames: dict[FrameKey, list[CanFrame]]
    ) -> None:
        self.source = source
        self.messages = messages
        self.frames = frames
        self.decoded: dict[FrameKey, list[dict[str, Any]]] = {}
        self.places: dict[str, list[tuple[FrameKey, Any]]] = {}
        for key, message in messages.items():
            for signal in message.signals:
                self.places.setdefault(signal.name, []).append((key, signal))
                self.places.setdefault(f"{message.name}.{signal.name}", []).append((key, signal))

    def to_recorded_file(self) -> RecordedFile:
        """Return the log as a recorded file of the signals whose messages occur in it."""
        names = [
            name for name, places in self.places.items() for key, _ in places if key in self.frames
        ]
        count = sum(len(frames) for frames in self.frames.values())
        return RecordedFile(
            self.source,
            "signal",
            names,
            self.samples,
            count,
            True,
            explain_missing=self.explain_missing,
        )

    def explain_missing(self, name: str) -> str:
        """Return the reason why a signal is missing; an empty text if none is known."""
        for key, _ in self.places.get(name, []):
            message = self.messages[key]
            return f"its message `{message.name}` ({key[0]:#x}) is not in the log"
        if not any(key in self.messages for key in self.frames):
            return f"the DBC has none of the {len(self.frames)} messages of the log"
        return ""

    def samples(self, name: str) -> Samples:
        """Return the values of a signal, named by itself or as `message.signal`.

        ValueError: the name stands for signals of several messages in the log.
        """
        ((key, signal),) = [place for place in self.places[name] if place[0] in self.frames]
        decoded = self._decode(key)
        frames = self.frames[key]
        values: list[float | None] = [_to_float(values.get(signal.name)) for values in decoded]
        return Samples(
            values,
            lambda k: repr(values[k]),
            lambda k: Span(self.source, k + 1, 1),
            [exact_fraction(time) for time, _ in frames],
            signal.unit or "",
        )

    def _decode(self, key: FrameKey) -> Sequence[dict[str, Any]]:
        """Return the decoded values of each frame of a message, cached.

        Raises SpecError if a frame does not fit the database.
        """
        if key not in self.decoded:
            message, decoded = self.messages[key], []
            for k, (time, data) in enumerate(self.frames[key], start=1):
                try:
                    decoded.append(message.decode(data, decode_choices=False))
                except Exception as error:
                    label = f"frame {k} of message `{message.name}`, at {time:.6g} s, has "
                    label += (
                        f"{len(data)} bytes, the DBC says {message.length}: {_first_line(error)}"
                    )
                    raise SpecError([Problem("value", Span(self.source, k, 1), label)]) from None
            self.decoded[key] = decoded
        return self.decoded[key]


def _to_float(value: Any) -> float | None:
    """Return a value as float; None remains None."""
    return None if value is None else float(value)


def _first_line(error: Exception) -> str:
    """Return the first line of an error message, or the name of the error."""
    text = str(error).strip().splitlines()
    return text[0].rstrip(".") if text else type(error).__name__
