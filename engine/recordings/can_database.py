"""CAN database: reads DBC files (also ARXML, KCD, SYM) as messages, and decodes single signals.

A DBC statement that cantools refuses is left out and told, so that the other messages can be read.
"""

from __future__ import annotations

import copy
import logging
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from engine.recordings.dbc_text import explain_left_out, find_statements, read_dbc_text
from engine.recordings.recording_file import (
    LFS_HELP,
    Assumption,
    first_line,
    is_lfs_pointer,
)
from language.model.system import RecordingMap
from language.text.diagnostic import Problem, Problems, SpecError
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
IMPORT = re.compile(r'"IMPORT ([\w./-]+)"')
"""Comment of a part of a DBC file that names another part, in the generator of opendbc."""
LIBRARY_ERROR = re.compile(r"^[A-Z]+: ")
"""Start of an error of cantools, with the format of the file."""
LIBRARY_FAULTS = (AttributeError, IndexError, KeyError, TypeError)
"""Errors of cantools whose text says nothing to a user."""
CONVERT_HELP = "a DBC file of the same bus is read (the package canmatrix converts databases)"
"""What helps if a database of another format cannot be understood."""
FLOAT_BITS = (16, 32, 64)
"""Numbers of bits of a floating-point signal."""
NO_MESSAGE = "contains no message"
"""Value of the assumption that a database has no message."""
J1939_NULL_ADDRESS = 0xFE
"""Source address of messages in J1939 databases that any node sends."""


@dataclass(frozen=True)
class CanMessage:
    """A message of a database (`definition`, of cantools), and the bus on which it is.

    Without a bus (an empty text) the message is on each bus of a log.
    """

    definition: Any
    bus: str = ""

    def is_on(self, bus: str) -> bool:
        """Return whether the message can be on a bus; the case of its name does not count."""
        return self.bus.lower() in ("", bus.lower())


@dataclass(frozen=True)
class CanSignal:
    """A signal of a message; `selector` selects the frames that contain it (multiplexing).

    `is_unselectable` tells that the database gives the signal values of a multiplexer that its
    message does not have. `fault` says why a signal cannot be decoded.
    """

    message: Any
    signal: Any
    selector: CanSignal | None = None
    is_unselectable: bool = False

    @property
    def fault(self) -> str:
        """The reason why the signal or a selector of it has no value; empty if it has one."""
        signal = self.signal
        if self.is_unselectable:
            text = "the DBC says that a multiplexer of message "
            return text + f"`{self.message.name}` selects it, but the message has none"
        if signal.start < 0 or signal.length < 1:
            return f"the DBC gives it {signal.length} bits from bit {signal.start} on"
        if signal.is_float and signal.length not in FLOAT_BITS:
            text = f"the DBC calls it a floating-point number of {signal.length} bits; "
            return text + f"there are {', '.join(map(str, FLOAT_BITS))}"
        if self.selector is not None and self.selector.fault:
            return f"its multiplexer `{self.selector.signal.name}`: {self.selector.fault}"
        return ""

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

        `data` has at least `length` bytes, and the signal no `fault`. A value that is too large for
        a float is infinite.
        """
        values = self._codec.decode(data, decode_choices=False, scaling=not is_raw)
        value = values[self.signal.name]
        try:
            return float(value)
        except OverflowError:  # an integer times an integer factor
            return math.inf if value > 0 else -math.inf

    def is_selected(self, data: bytes) -> bool:
        """Return whether a frame contains the signal."""
        if self.selector is None:
            return True
        if not self.selector.is_selected(data):
            return False
        return self.selector.selection(data) in self.signal.multiplexer_ids

    def selection(self, data: bytes) -> int:
        """Return the bits of a multiplexer as a number without sign, as databases list them."""
        mask: int = (1 << self.signal.length) - 1
        return int(self.decode(data, is_raw=True)) & mask

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

    def with_selector(signal: Any, selected: tuple[str, ...] = ()) -> CanSignal:
        if not signal.multiplexer_ids:
            return CanSignal(message, signal)
        parent = by_name.get(signal.multiplexer_signal)
        if parent is None or parent.name in (*selected, signal.name):
            return CanSignal(message, signal, is_unselectable=True)
        selector = with_selector(parent, (*selected, signal.name))
        return CanSignal(message, signal, selector, selector.is_unselectable)

    return [with_selector(signal) for signal in message.signals]


def unknown_selection(message: Any, selector: CanSignal, data: bytes) -> int | None:
    """Return the value of a selector that no signal of its message has; None for a known value."""
    value = selector.selection(data)
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


def read_databases(
    mapping: RecordingMap, cantools: Any
) -> tuple[list[CanMessage], list[Assumption]]:
    """Return the messages of the databases of a map, and what is left out.

    A database is searched relative to the map, then to the working directory, and has to lie inside
    the project. A message that two databases of a bus define in the same way is returned once.
    Raises SpecError, also if no database has a message.
    """
    logging.getLogger("cantools").setLevel(logging.CRITICAL)
    problems = Problems()
    messages: dict[tuple[str, str], CanMessage] = {}
    assumed: list[Assumption] = []
    for database in mapping.databases:
        written = database.file
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
                key = (database.bus.lower(), _definition(message))
                messages.setdefault(key, CanMessage(message, database.bus))
    problems.raise_if_errors()
    if mapping.databases and not messages:
        files = ", ".join(f"`{database.file.text}`" for database in mapping.databases)
        label = f"{files} {'have' if len(mapping.databases) > 1 else 'has'} no message"
        hint = "; ".join(item.reason for item in assumed if item.value == NO_MESSAGE)
        raise SpecError([Problem("empty", mapping.databases[0].file.span, label, hint)])
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
    is_dbc = path.suffix.lower() == DATABASE_SUFFIXES[0]
    if is_lfs_pointer(data):
        label = f"`{written.text}` is a pointer of Git LFS, and not the database"
        problems.error("unreadable", written.span, label, LFS_HELP)
        return []
    try:
        messages, left_out, repaired = _load_messages(path, data, written.text, cantools)
        assumed += repaired
    except Exception as error:  # the library raises errors of any type for a broken file
        text = LIBRARY_ERROR.sub("", str(error)).strip('"').replace(">>!<<", "")
        reason = " ".join(text.split()) or first_line(error)
        if any(isinstance(part, LIBRARY_FAULTS) for part in (error, *vars(error).values())):
            reason = "the package cantools fails at it"
        label = f"`{written.text}` cannot be understood: {reason}"
        problems.error("unreadable", written.span, label, "" if is_dbc else CONVERT_HELP)
        return []
    if left_out:
        value = f"{len(left_out)} statements left out"
        assumed.append(Assumption(f"`{written.text}`", value, left_out[0]))
    if left_out and not messages:
        label = f"`{written.text}` cannot be understood: {left_out[0]}"
        problems.error("unreadable", written.span, label)
    elif not messages:
        parts = IMPORT.findall(data.decode("utf-8", "replace"))
        reason = "the file has no statement `BO_`" if is_dbc else "the file defines no frame"
        if parts:
            reason += ", but names other files: `dbc:` in the map lists them instead: "
            reason += ", ".join(f"`{part}`" for part in parts)
        assumed.append(Assumption(f"`{written.text}`", NO_MESSAGE, reason))
    return messages


def _load_messages(
    path: Path, data: bytes, name: str, cantools: Any
) -> tuple[Sequence[Any], list[str], list[Assumption]]:
    """Return the messages of a database, sentences on statements left out, and what is assumed.

    Statements of a DBC file that cantools refuses are left out in `MAX_ROUNDS` rounds at most.
    Raises the error of cantools that remains.
    """
    if path.suffix.lower() != ".dbc":
        return cantools.database.load_file(path, strict=False).messages, [], []
    text = read_dbc_text(data, name)
    messages: list[Any] = []
    for k in range(MAX_ROUNDS + 1 if any(text.lines) else 0):
        try:
            written = "\n".join(text.lines) + "\n"
            messages = cantools.database.load_string(written, "dbc", strict=False).messages
            break
        except cantools.database.UnsupportedDatabaseFormatError as error:
            removed = _blank_statements(text.lines, str(error)) if k < MAX_ROUNDS else []
            if not removed:
                raise
            text.left_out += removed
    text.complete(messages)
    return messages, text.left_out, text.assumptions


def _blank_statements(lines: list[str], error: str) -> list[str]:
    """Replace the statements that an error of cantools names by blank lines.

    Returns a sentence on each of them; empty if the error names none.
    """
    bounds = list(find_statements(lines))
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
        if lines[start].lstrip().startswith("BO_"):  # its signals would belong to another message
            while k + 1 < len(bounds) and lines[bounds[k + 1][0]].lstrip().startswith("SG_ "):
                k += 1
                end = bounds[k][1]
        removed.append(explain_left_out(start, lines[start]))
        lines[start:end] = [""] * (end - start)
    return removed
