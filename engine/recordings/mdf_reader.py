"""MDF reader: reads the channels of an MDF file, each with the time stamps of its group."""

from __future__ import annotations

import contextlib
import gc
import io
import logging
import math
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from engine.recordings.can_database import read_databases
from engine.recordings.can_log import CanFrame, CanLog, FrameKey, remove_repeated_frames
from engine.recordings.can_reader import decode_can, import_can
from engine.recordings.mdf_layout import explain_outside
from engine.recordings.recording_file import (
    NO_VALUE,
    Assumption,
    RecordedFile,
    Samples,
    exact_fraction,
    first_line,
    require_size,
    unreadable_error,
)
from engine.recordings.text_dialect import DECIMAL
from language.model.system import RecordingMap
from language.overlays.expand_document import display_path
from language.text.diagnostic import MissingToolError, Problem, Source, Span, SpecError

TIME_MASTERS = (0, 1)
"""Types of synchronisation of a master channel of time (ASAM MDF 4.1: 1; not stated: 0)."""
SYNC_QUANTITIES = {2: "an angle", 3: "a distance", 4: "an index"}
"""Quantities of the other master channels by their type of synchronisation."""
CAN_FRAMES = "CAN_DataFrame"
"""Name of the channel that contains the frames of a CAN bus (ASAM MDF bus logging)."""
CAN_CHANNELS = (CAN_FRAMES, "CAN_ErrorFrame", "CAN_RemoteFrame")
"""Channels of bus logging, which are no signals; the parts of a frame follow with a dot."""
EXTENDED_FLAG = 1 << 31
"""Bit of an identifier that marks an extended one."""
MAGIC = (b"MDF     ", b"UnFinMF ")
"""First bytes of a finished and of an unfinished MDF file."""
MIN_SIZE = 168
"""Size of the first two blocks of an MF4 file in bytes."""
MAX_DEFLATE_RATIO = 1032
"""Largest ratio of data to their compressed form (zlib, "Technical Details")."""
MAX_WORDS = 6
"""Number of words of a conversion that a note lists."""

Place = tuple[int, int]
"""Index of a group and of a channel in it."""


def read_mdf(path: Path, mapping: RecordingMap) -> RecordedFile:
    """Open an MDF file of version 3 or 4; channels are read on demand and cached.

    Names are those of all channels but the masters of groups, as often as they occur. A channel
    whose name occurs several times has further names `group.channel`, where `group` is the name,
    source or number of its group (`group0`). Frames of a CAN bus are decoded with the databases of
    the map, with the names of `decode_can`. Raises SpecError if the file cannot be read, is empty,
    too large or does not start as MDF (`MAGIC`), and MissingToolError without asammdf. Messages of
    asammdf are silenced.
    """
    source = Source(display_path(path))
    require_size(path, source)
    try:
        import asammdf
    except ImportError:
        raise MissingToolError(
            "an MF4 file needs the package `asammdf`: pip install 'modewright[mdf]'"
        ) from None
    data = path.read_bytes()
    if len(data) < MIN_SIZE or not data.startswith(MAGIC):
        raise unreadable_error(source, "understood as MDF: it does not start like one")
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    file = _MdfFile(_open_mdf(asammdf, data, source), source, mapping, len(data))
    return file.with_bus(file.to_recorded_file())


def _open_mdf(asammdf: Any, data: bytes, source: Source) -> Any:
    """Return the bytes of a file as an asammdf object. Raises SpecError.

    The library copies a file that is marked as unfinished to the temporary folder, but not bytes.
    Errors that it raises during garbage collection of a broken file are suppressed.
    """
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return asammdf.MDF(io.BytesIO(data))
    except Exception as error:
        message = first_line(error)
        if "BytesIO" in message:  # the name of an object of Python
            message = "its blocks cannot be read"
    finally:
        gc.collect()  # destructors of broken objects run while their errors are suppressed
        sys.unraisablehook = hook
    raise unreadable_error(source, f"understood as MDF, it may be damaged: {message}")


@dataclass(frozen=True)
class _MdfFile:
    """Channels of an MDF file of `size` bytes; `mdf` is its asammdf object."""

    mdf: Any
    source: Source
    mapping: RecordingMap
    size: int

    @cached_property
    def places(self) -> dict[str, list[Place]]:
        """Places of the channels without masters by their names, also those with their group."""
        places: dict[str, list[Place]] = {}
        for name, found in self.mdf.channels_db.items():
            own = [(int(g), int(c)) for g, c in found if self.mdf.masters_db.get(g) != c]
            if own:
                places[name] = own
        for name, own in list(places.items()):
            for place in own if len(own) > 1 else ():
                for label in self._labels(place):
                    places.setdefault(f"{label}.{name}", []).append(place)
        return places

    def _labels(self, place: Place) -> list[str]:
        """Return the names of a channel's group and of its source, and the number of the group."""
        group = self.mdf.groups[place[0]]
        channel = group.channels[place[1]]
        sources = [
            getattr(group.channel_group, "acq_source", None),
            getattr(channel, "source", None),
        ]
        labels = [getattr(group.channel_group, "acq_name", "")]
        labels += [text for one in sources if one is not None for text in (one.name, one.path)]
        labels.append(f"group{place[0]}")
        return [label for label in dict.fromkeys(labels) if label]

    def to_recorded_file(self) -> RecordedFile:
        """Return the channels as a recorded file."""
        names = [name for name, places in self.places.items() for _ in places]
        cached: dict[str, Samples] = {}

        def read(name: str) -> Samples:
            if name not in cached:
                cached[name] = self._samples(name)
            return cached[name]

        return RecordedFile(
            self.source,
            "channel",
            names,
            read,
            len(names),
            is_stamped=True,
            explain_missing=self._explain_missing,
            explain_ambiguous=self._explain_ambiguous,
        )

    def _explain_ambiguous(self, name: str) -> str:
        """Return the names that select one of the channels of a name."""
        chosen = []
        for place in self.places[name]:
            labels = [f"{label}.{name}" for label in self._labels(place)]
            chosen += [one for one in labels if len(self.places.get(one, ())) == 1][:1]
        listed = ", ".join(f"`{one}`" for one in chosen)
        return f"`column:` in the map names one of them: {listed}" if listed else ""

    def _explain_missing(self, name: str) -> str:
        """Return the hint that frames of a bus need a database, if the map names none."""
        if CAN_FRAMES in self.places and not self.mapping.databases:
            return (
                "the file contains frames of a CAN bus: `dbc: vehicle.dbc` in the map decodes them"
            )
        return ""

    def with_bus(self, file: RecordedFile) -> RecordedFile:
        """Return a file with the signals of its CAN frames, if the map names databases.

        A signal of a frame replaces a channel of its name.
        """
        if CAN_FRAMES not in self.places or not self.mapping.databases:
            return file
        _, cantools = import_can("an MF4 file with frames of a CAN bus")
        messages, assumed = read_databases(self.mapping, cantools)
        bus = decode_can(self.source, messages, self._read_frames(), tuple(assumed))
        signals = set(bus.names)
        channels = [
            name for name in file.names if not name.startswith(CAN_CHANNELS) and name not in signals
        ]
        return RecordedFile(
            self.source,
            "channel",
            [*channels, *bus.names],
            lambda name: bus.read(name) if name in signals else file.read(name),
            file.rows,
            is_stamped=True,
            explain_missing=bus.explain_missing,
            explain_ambiguous=lambda name: (
                bus.explain_ambiguous(name) if name in signals else file.explain_ambiguous(name)
            ),
            assumptions=bus.assumptions,
        )

    def _read_frames(self) -> CanLog:
        """Return the data frames of all groups of CAN frames, in the order of time."""
        frames: dict[FrameKey, list[CanFrame]] = {}
        count = 0
        for group, index in self.places[CAN_FRAMES]:
            self._require_rows(CAN_FRAMES, group)
            self._require_inside((group, index))
            try:
                signal = self.mdf.get(group=group, index=index)
                table, stamps = signal.samples, signal.timestamps.tolist()
                column = {n.rpartition(".")[2]: table[n] for n in table.dtype.names or ()}
                numbers = [int(number) for number in column["ID"]]
                lengths = [int(length) for length in column["DataLength"]]
                rows = [bytes(row) for row in column["DataBytes"]]
            except Exception as error:  # the library raises errors of any type for a broken file
                raise unreadable_error(
                    self.source, f"understood as frames of a CAN bus: {first_line(error)}"
                ) from None
            buses = column.get("BusChannel", [0] * len(rows))
            extended = column.get("IDE", [number & EXTENDED_FLAG for number in numbers])
            for time, number, length, row, bus, ide in zip(
                stamps, numbers, lengths, rows, buses, extended, strict=True
            ):
                count += 1
                key = FrameKey(f"CAN{int(bus)}", number & ~EXTENDED_FLAG, bool(ide))
                frames.setdefault(key, []).append(CanFrame(time, row[:length], count))
        assumed: list[Assumption] = []
        ordered = {
            key: sorted(series, key=lambda frame: frame.time) for key, series in frames.items()
        }
        return CanLog(remove_repeated_frames(ordered, assumed), tuple(assumed))

    def _require_rows(self, name: str, group: int) -> None:
        """Raise SpecError if a group states more rows than the file can have.

        The library would allocate and read them all.
        """
        stated = self.mdf.groups[group].channel_group
        rows, width = int(stated.cycles_nr), int(stated.samples_byte_nr)
        if rows * max(width, 1) > MAX_DEFLATE_RATIO * self.size:
            label = f"channel `{name}`: its group states {rows} rows of {width} bytes, "
            label += f"more than a file of {self.size} bytes can have"
            raise unreadable_error(self.source, f"understood: {label}")

    def _require_inside(self, place: Place) -> None:
        """Raise SpecError if a channel lies outside of its records, or if that is not known.

        The library would read other memory.
        """
        try:
            reason = explain_outside(self.mdf, *place)
        except Exception as error:  # the library raises errors of any type for a broken file
            reason = first_line(error)
        if reason:
            raise unreadable_error(self.source, f"understood, it may be damaged: {reason}")

    def _samples(self, name: str) -> Samples:
        """Return the samples of a channel; arrays are NaN.

        Values that are NaN, that the file marks as invalid, or that its conversion calls missing,
        are None.
        Raises SpecError if the channel cannot be read or its group has no time.
        """
        (place,) = self.places[name]
        self._require_rows(name, place[0])
        self._require_inside(place)
        try:
            signal = self.mdf.get(group=place[0], index=place[1], ignore_invalidation_bits=True)
            values = np.asarray(signal.samples)
            raw = values
            if values.ndim == 1 and values.dtype.kind not in "biuf":
                raw = np.asarray(self.mdf.get(group=place[0], index=place[1], raw=True).samples)
        except Exception as error:
            raise unreadable_error(
                self.source, f"understood: channel `{name}`: {first_line(error)}"
            ) from None
        stamps = self._stamps(name, place, signal.timestamps)
        assumed: list[Assumption] = []
        if values.ndim != 1 or values.dtype.names:
            texts = [str(value) for value in values]
            numbers: list[float | None] = [math.nan] * len(values)
        elif values.dtype.kind in "biuf":
            texts = [repr(float(value)) for value in values]
            numbers = [None if math.isnan(value) else float(value) for value in values]
        else:
            numbers, texts = _convert_texts(name, values.tolist(), raw, assumed)
        invalid = getattr(signal, "invalidation_bits", None)
        if invalid is not None:
            flags = np.asarray(invalid)
            numbers = [None if bad else v for v, bad in zip(numbers, flags, strict=True)]
        return Samples(
            numbers,
            lambda k: texts[k],
            lambda k: Span(self.source, k + 1, 1),
            stamps,
            signal.unit or "",
            () if values.dtype.kind in "biuf" or values.ndim != 1 else texts,
            tuple(assumed),
        )

    def _stamps(self, name: str, place: Place, stamps: Any) -> list[Fraction]:
        """Return the time stamps [s] of a channel.

        They are those of the master of its group, else of the channel that the map calls its time.
        Raises SpecError if there is neither.
        """
        group = self.mdf.groups[place[0]]
        master = self.mdf.masters_db.get(place[0])
        kind = getattr(group.channels[master], "sync_type", 1) if master is not None else None
        if kind in TIME_MASTERS:
            return self._exact_stamps(stamps)
        time = self.mapping.time
        own = next((c for g, c in self.places.get(time, ()) if g == place[0]), None)
        if own is not None:
            self._require_inside((place[0], own))
            cells = self.mdf.get(group=place[0], index=own).samples
            factor = self.mapping.time_unit.factor
            return [stamp * factor for stamp in self._exact_stamps(cells)]
        label = f"channel `{name}` has no time: its group has no master channel"
        if kind is not None:
            label = f"channel `{name}` has no time: the master channel of its group is "
            label += SYNC_QUANTITIES.get(kind, f"of type {kind}")
        others = [c.name for k, c in enumerate(group.channels) if k not in (place[1], master)]
        listed = ", ".join(f"`{one}`" for one in others[:MAX_WORDS])
        help = "`time: {column: t, unit: s}` in the map names a channel of the group as its time"
        help += f"; the group has {listed}" if listed else ""
        raise SpecError([Problem("time", Span(self.source, 1, 1), label, help)])

    def _exact_stamps(self, stamps: Any) -> list[Fraction]:
        """Return time stamps as fractions, in their unit.

        Raises SpecError for a stamp that is no finite number.
        """
        array = np.asarray(stamps)
        is_number = array.ndim == 1 and array.dtype.kind in "biuf"
        bad = np.flatnonzero(~np.isfinite(array)) if is_number else np.zeros(1, dtype=np.int64)
        if not is_number or len(bad):
            shown = f" `{array[bad[0]]}`" if is_number else ""
            label = f"the time stamp{shown} is not a finite number"
            raise SpecError([Problem("time", Span(self.source, int(bad[0]) + 1, 1), label)])
        return [exact_fraction(time) for time in array]


def _convert_texts(
    name: str, values: Sequence[Any], raw: Any, assumed: list[Assumption]
) -> tuple[list[float | None], list[str]]:
    """Return the numbers and the texts of a channel of texts, or with a conversion to texts.

    A word for a missing value gives None, a text channel the numbers that its texts write, else
    NaN. If a conversion names all values of a channel, these are an enumeration, and its numbers
    are the raw values; if it names some, the others are numbers, and these words are NaN.
    """
    texts = [_to_text(value) for value in values]
    is_text = np.asarray(raw).dtype.kind not in "biuf"
    words = [t for t, v in zip(texts, values, strict=True) if t and isinstance(v, bytes | str)]
    is_enumeration = len(words) == len(texts)
    numbers: list[float | None] = []
    for k, text in enumerate(texts):
        if NO_VALUE.fullmatch(text):
            numbers.append(None)
        elif is_text:
            numbers.append(float(text) if DECIMAL.fullmatch(text) else math.nan)
        elif not isinstance(values[k], bytes | str):
            numbers.append(float(values[k]))
        else:
            numbers.append(float(raw[k]) if is_enumeration or not text else math.nan)
    missing = Counter(text for text in texts if NO_VALUE.fullmatch(text))
    for word, count in missing.items():
        value = f"{count} of {len(texts)} samples have no value"
        assumed.append(Assumption(f"channel `{name}`", value, f"the file calls them `{word}`"))
    codes = {t: n for t, n in zip(texts, numbers, strict=True) if n is not None and t}
    if is_enumeration and not is_text and codes:
        listed = ", ".join(f"`{word}` is {number:g}" for word, number in list(codes.items())[:6])
        reason = f"the file converts them to words: {listed}"
        assumed.append(Assumption(f"values of channel `{name}`", "numbers", reason))
    return numbers, texts


def _to_text(value: Any) -> str:
    """Return a sample as text, without trailing blanks and zero bytes."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return text.strip("\0 \r\n\t")
