"""CAN database: reads DBC files (also ARXML, KCD, SYM) as messages, and decodes single signals.

A DBC statement that cantools refuses is left out and told, so that the other messages can be read.
"""

from __future__ import annotations

import copy
import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from engine.recordings.recording_file import Assumption, first_line
from language.model.system import RecordingMap
from language.text.diagnostic import Problems
from language.text.document import ScalarNode
from language.text.project_boundary import path_exists, project_root_of, require_inside_project
from language.text.regular_file import open_regular_file

DATABASE_SUFFIXES = (".dbc", ".arxml", ".kcd", ".sym")
"""Suffixes of files that describe CAN messages; the first is suggested."""
MAX_ROUNDS = 20
"""Largest number of times that a DBC file is read again without statements that are refused."""
UNUSED = re.compile(r"^\s*(VAL_|SIG_VALTYPE_)\s+(\d+)\s+(\w+)", re.MULTILINE)
"""Entries for signals that do not exist, as cantools lists them."""
SYNTAX_LINE = re.compile(r"[Ii]nvalid syntax at line (\d+)")
"""Error of cantools that names the line of a statement."""
BAD_MESSAGE = re.compile(r"in message (\w+)")
"""Error of cantools that names a message."""
STATEMENT = re.compile(r"[ \t]*([A-Z][A-Z_]*_|VERSION)\b")
"""Keyword at the start of a DBC statement."""
REQUIRED = ("VERSION", "NS_", "BS_", "BU_")
"""Statements that cannot be left out."""
J1939_NULL_ADDRESS = 0xFE
"""Source address of messages in J1939 databases that any node sends."""


@dataclass(frozen=True)
class CanSignal:
    """A signal of a message; `selector` selects the frames that contain it (multiplexing)."""

    message: Any
    signal: Any
    selector: CanSignal | None = None

    @cached_property
    def length(self) -> int:
        """Number of bytes that a frame needs: those of its message, and of the signal."""
        start = self.signal.start
        if self.signal.byte_order == "big_endian":
            first = 8 * (start // 8) + 7 - start % 8
        else:
            first = start
        needed = (first + self.signal.length + 7) // 8
        own: int = max(self.message.length, needed)
        return max(own, self.selector.length) if self.selector else own

    @cached_property
    def _codec(self) -> Any:
        """The message with this signal alone, which overlapping signals do not disturb."""
        signal = copy.copy(self.signal)
        signal.is_multiplexer = False
        signal.multiplexer_ids = signal.multiplexer_signal = None
        message = self.message
        return type(message)(
            message.frame_id,
            message.name,
            self.length,
            [signal],
            is_extended_frame=message.is_extended_frame,
            strict=False,
        )

    def decode(self, data: bytes, is_raw: bool = False) -> float:
        """Return the value in the unit of the signal, or the raw value.

        `data` has at least `length` bytes.
        """
        values = self._codec.decode(data, decode_choices=False, scaling=not is_raw)
        return float(values[self.signal.name])

    def is_selected(self, data: bytes) -> bool:
        """Return whether a frame contains the signal."""
        if self.selector is None:
            return True
        if not self.selector.is_selected(data):
            return False
        return int(self.selector.decode(data, is_raw=True)) in self.signal.multiplexer_ids

    def word(self, data: bytes) -> str:
        """Return the word of the database for the value of a frame; empty if it has none."""
        choices = self.signal.choices
        if not choices:
            return ""
        return str(choices.get(int(self.decode(data, is_raw=True)), ""))

    @property
    def overlapping(self) -> list[str]:
        """Names of the signals that share a bit of every frame with this one."""
        own = _bits(self.signal)
        return [
            other.name
            for other in self.message.signals
            if other is not self.signal
            and own & _bits(other)
            and other.multiplexer_signal == self.signal.multiplexer_signal
            and other.multiplexer_ids == self.signal.multiplexer_ids
        ]


def _bits(signal: Any) -> set[int]:
    """Return the bits of a signal, 8 times the byte plus the bit in the byte."""
    if signal.byte_order == "little_endian":
        return set(range(signal.start, signal.start + signal.length))
    first = 8 * (signal.start // 8) + 7 - signal.start % 8
    return {8 * (k // 8) + 7 - k % 8 for k in range(first, first + signal.length)}


def signals_of(message: Any) -> list[CanSignal]:
    """Return the signals of a message, with their selectors."""
    by_name = {signal.name: signal for signal in message.signals}

    def with_selector(signal: Any) -> CanSignal:
        parent = by_name.get(signal.multiplexer_signal) if signal.multiplexer_ids else None
        return CanSignal(message, signal, with_selector(parent) if parent else None)

    return [with_selector(signal) for signal in message.signals]


def unknown_selection(message: Any, selector: CanSignal, data: bytes) -> int | None:
    """Return the value of a selector that no signal of its message has; None for a known value."""
    value = int(selector.decode(data, is_raw=True))
    name = selector.signal.name
    known = (s.multiplexer_ids for s in message.signals if s.multiplexer_signal == name)
    return None if any(value in ids for ids in known) else value


def parameter_group(identifier: int) -> int:
    """Return the parameter group number (PGN) of an extended identifier of J1939.

    The destination address of a PDU1 format (format below 240) is not part of it.
    """
    group = identifier >> 8 & 0x3FFFF
    return group if group >> 8 & 0xFF >= 240 else group & 0x3FF00


def is_j1939(message: Any) -> bool:
    """Return whether a database says that any node sends a message of J1939.

    Its protocol is J1939, or its source address is the null address.
    """
    if not message.is_extended_frame:
        return False
    return bool(message.protocol == "j1939" or message.frame_id & 0xFF == J1939_NULL_ADDRESS)


def read_databases(mapping: RecordingMap, cantools: Any) -> tuple[list[Any], list[Assumption]]:
    """Return the messages of the databases of a map, and what is left out.

    A database is searched relative to the map, then to the working directory, and has to lie inside
    the project. A message that two databases define in the same way is returned once. Raises
    SpecError.
    """
    logging.getLogger("cantools").setLevel(logging.CRITICAL)
    problems = Problems()
    messages: dict[str, Any] = {}
    assumed: list[Assumption] = []
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
            for message in _read_database(paths[0], written, cantools, problems, assumed):
                messages.setdefault(_definition(message), message)
    problems.raise_if_errors()
    return list(messages.values()), assumed


def _definition(message: Any) -> str:
    """Return a text that is equal for messages of equal identifiers, names and signals."""
    signals = [
        (s.name, s.start, s.length, s.byte_order, s.is_signed, s.scale, s.offset, s.unit,
         s.multiplexer_ids, s.multiplexer_signal)
        for s in message.signals
    ]  # fmt: skip
    return repr(
        (message.frame_id, message.is_extended_frame, message.name, message.length, signals)
    )


def _read_database(
    path: Path, written: ScalarNode, cantools: Any, problems: Problems, assumed: list[Assumption]
) -> Sequence[Any]:
    """Return the messages of a database; a file that cannot be understood is reported."""
    try:
        with open_regular_file(path) as file:
            data = file.read()
    except OSError as error:
        label = f"`{written.text}` cannot be read: {error.strerror or error}"
        problems.error("unreadable", written.span, label)
        return []
    try:
        messages, left_out = _load_messages(path, data, cantools)
    except Exception as error:  # the library raises errors of any type for a broken file
        text = str(error).removeprefix("DBC: ").strip('"')
        reason = " ".join(text.split()) or first_line(error)
        label = f"`{written.text}` cannot be understood: {reason}"
        problems.error("unreadable", written.span, label)
        return []
    if left_out:
        value = f"{len(left_out)} statements left out"
        reason = f"{left_out[0]} does not fit the others or is no statement of a DBC"
        assumed.append(Assumption(f"`{written.text}`", value, reason))
    if left_out and not messages:
        label = f"`{written.text}` cannot be understood: {left_out[0]} is no statement of a DBC"
        problems.error("unreadable", written.span, label)
    return messages


def _load_messages(path: Path, data: bytes, cantools: Any) -> tuple[Sequence[Any], list[str]]:
    """Return the messages of a database, and texts for the statements that are left out.

    Statements of a DBC file that cantools refuses are left out in `MAX_ROUNDS` rounds at most.
    Raises the error of cantools that remains.
    """
    if path.suffix.lower() != ".dbc":
        return cantools.database.load_file(path, strict=False).messages, []
    lines = _decode(data).splitlines()
    left_out: list[str] = []
    for _ in range(MAX_ROUNDS):
        try:
            text = "\n".join(lines) + "\n"
            return cantools.database.load_string(text, "dbc", strict=False).messages, left_out
        except cantools.database.UnsupportedDatabaseFormatError as error:
            removed = _blank_statements(lines, str(error))
            if not removed:
                raise
            left_out += removed
    text = "\n".join(lines) + "\n"
    return cantools.database.load_string(text, "dbc", strict=False).messages, left_out


def _decode(data: bytes) -> str:
    """Return the text of a DBC file in UTF-8, else in Windows-1252, as most tools write it."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _blank_statements(lines: list[str], error: str) -> list[str]:
    """Replace the statements that an error of cantools names by blank lines.

    Returns a text for each of them; empty if the error names none that can be left out.
    """
    starts = [k for k, line in enumerate(lines) if STATEMENT.match(line)]
    bounds = list(zip(starts, [*starts[1:], len(lines)], strict=True))
    chosen: list[int] = []
    for keyword, identifier, name in UNUSED.findall(error):
        pattern = re.compile(rf"\s*{keyword}\s+{identifier}\s+{name}\b")
        chosen += [k for k, (start, _) in enumerate(bounds) if pattern.match(lines[start])]
    if not chosen and (match := SYNTAX_LINE.search(error)):
        number = int(match[1]) - 1
        chosen = [k for k, (start, end) in enumerate(bounds) if start <= number < end]
    if not chosen and (match := BAD_MESSAGE.search(error)):
        pattern = re.compile(rf"\s*BO_\s+\d+\s+{match[1]}\b")
        chosen = [k for k, (start, _) in enumerate(bounds) if pattern.match(lines[start])]
    removed = []
    for k in chosen:
        start, end = bounds[k]
        keyword = STATEMENT.match(lines[start])[1]  # type: ignore[index]
        if keyword in REQUIRED:
            return []
        if keyword == "BO_":  # without its head line its signals would belong to another message
            while k + 1 < len(bounds) and lines[bounds[k + 1][0]].lstrip().startswith("SG_ "):
                k += 1
                end = bounds[k][1]
        removed.append(f"line {start + 1} (`{' '.join(lines[start].split()[:3])}`)")
        lines[start:end] = [""] * (end - start)
    return removed
