"""CAN reader: decodes the frames of a log with the databases of the map, signal by signal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from engine.recordings.can_database import (
    CanMessage,
    CanSignal,
    is_j1939,
    parameter_group,
    read_databases,
    signals_of,
    unknown_selection,
)
from engine.recordings.can_log import CanFrame, CanLog, FrameKey, read_can_log
from engine.recordings.recording_file import (
    NO_VALUE,
    Assumption,
    RecordedFile,
    Samples,
    exact_fraction,
    require_size,
)
from language.model.system import RecordingMap
from language.overlays.expand_document import display_path
from language.text.diagnostic import MissingToolError, Problem, Source, Span, SpecError

MULTIPLEXER_HELP = "a multiplexer has `M` behind its name in the DBC: ` SG_ Index M : 0|4@1+ ...`"
"""What helps if a message has no multiplexer for its signals."""
MAX_SHOWN = 3
"""Number of names or values that a message lists."""


def read_can(path: Path, mapping: RecordingMap) -> RecordedFile:
    """Read a log of CAN frames with the databases of the map.

    Error and remote frames are left out, see `decode_can` for the names. Raises SpecError if a file
    cannot be read or understood, the log is empty or too large, or the map names no database;
    MissingToolError without python-can or cantools.
    """
    source = Source(display_path(path))
    require_size(path, source)
    can, cantools = import_can("a log of CAN frames")
    if not mapping.databases:
        label = f"map `{mapping.name}` names no DBC, which a log of CAN frames needs"
        raise SpecError([Problem("missing", mapping.span, label, "`dbc: vehicle.dbc` in the map")])
    messages, assumed = read_databases(mapping, cantools)
    return decode_can(source, messages, read_can_log(path, source, can, mapping), tuple(assumed))


def import_can(what: str) -> tuple[Any, Any]:
    """Return the packages python-can and cantools. Raises MissingToolError, which names `what`."""
    try:
        import can
        import cantools
    except ImportError:
        raise MissingToolError(
            f"{what} needs the packages `python-can` and `cantools`: pip install 'modewright[can]'"
        ) from None
    return can, cantools


def decode_can(
    source: Source, messages: list[CanMessage], log: CanLog, assumed: tuple[Assumption, ...] = ()
) -> RecordedFile:
    """Return a log as a recorded file of the signals whose messages occur in it.

    A message is found by its identifier, else (J1939) by its parameter group, on the bus of its
    database. Names are `signal` and `message.signal`. If messages of a name are on several buses,
    there is `bus.message.signal`, too, and for several identifiers `0x18f00400.message.signal`.
    A name that stands for
    several signals occurs once for each of them and cannot be read. A signal is decoded when it is
    read. `Samples.assumptions` tell frames that are left out; reading raises SpecError if these
    are all.
    """
    return _DecodedLog(source, messages, log).to_recorded_file(assumed)


class _Place(NamedTuple):
    """Signal in the frames of a key; `names` are the names that stand for it, the longest last."""

    key: FrameKey
    signal: CanSignal
    names: tuple[str, ...]
    by_group: bool


class _DecodedLog:
    """Frames of a log with the messages that decode them."""

    def __init__(self, source: Source, messages: list[CanMessage], log: CanLog) -> None:
        self.source = source
        self.messages = messages
        self.log = log
        self.places: dict[str, list[_Place]] = {}
        found = [(message.definition, *self._keys_of(message)) for message in messages]
        keys_by_name: dict[str, set[FrameKey]] = {}
        for message, keys, _ in found:
            keys_by_name.setdefault(message.name, set()).update(keys)
        for message, keys, by_group in found:
            for place in _places_of(message, keys, by_group, keys_by_name[message.name]):
                for name in place.names:
                    self.places.setdefault(name, []).append(place)

    def _keys_of(self, message: CanMessage) -> tuple[list[FrameKey], bool]:
        """Return the keys of the frames of a message, and whether its parameter group found them.

        The buses are those of its database.
        """
        definition = message.definition
        identity = (definition.frame_id, definition.is_extended_frame)
        keys = [key for key in self.log.frames if key[1:] == identity and message.is_on(key.bus)]
        by_group = not keys and is_j1939(definition)
        if by_group:
            group = self._keys_of_group(definition.frame_id)
            keys = [key for key in group if message.is_on(key.bus)]
        return keys, by_group

    def _keys_of_group(self, identifier: int) -> list[FrameKey]:
        """Return the keys of extended frames with the parameter group of an identifier."""
        group = parameter_group(identifier)
        return [
            key
            for key in self.log.frames
            if key.is_extended and parameter_group(key.identifier) == group
        ]

    def to_recorded_file(self, assumed: tuple[Assumption, ...]) -> RecordedFile:
        """Return the log as a recorded file."""
        names = [name for name, places in self.places.items() for _ in places]
        count = sum(map(len, self.log.frames.values()))
        return RecordedFile(
            self.source,
            "signal",
            names,
            self.samples,
            count,
            True,
            explain_missing=self.explain_missing,
            explain_ambiguous=self.explain_ambiguous,
            assumptions=(*assumed, *self.log.assumptions),
        )

    def explain_missing(self, name: str) -> str:
        """Return the reason why a signal is missing; an empty text if none is known."""
        for declared in self.messages:
            message = declared.definition
            for signal in message.signals:
                if name in (signal.name, f"{message.name}.{signal.name}"):
                    number = f"{message.frame_id:#x}"
                    text = f"its message `{message.name}` ({number}) is not in the log"
                    if declared.bus:
                        text = f"its message `{message.name}` ({number}) is not on the bus "
                        return text + f"`{declared.bus}`; {self._list_buses()}"
                    return text + self._explain_near(message)
        buses = {key.bus.lower() for key in self.log.frames}
        for declared in self.messages:
            if declared.bus and declared.bus.lower() not in buses:
                return f"the log has no bus `{declared.bus}`; {self._list_buses()}"
        known = {
            (one.definition.frame_id, one.definition.is_extended_frame) for one in self.messages
        }
        if not any(key[1:] in known for key in self.log.frames):
            return f"the DBC has none of the {len(self.log.frames)} messages of the log"
        return ""

    def _list_buses(self) -> str:
        """Return the names of the buses of the log for messages."""
        buses = sorted({key.bus for key in self.log.frames})
        if not any(buses):
            return "the log names no bus, so that `dbc:` must not name one either"
        return f"the log has {_join([f'`{bus}`' for bus in buses if bus])}"

    def _explain_near(self, message: Any) -> str:
        """Return the identifiers of the log that resemble that of a message; else an empty text.

        These have the same parameter group, or the same number in the other format, or they differ
        in one digit apart from the source address.
        """
        number = message.frame_id
        same_group = self._keys_of_group(number) if message.is_extended_frame else []
        if same_group:
            found = _join(f"{key.identifier:#x}" for key in same_group)
            return (
                f"; the log has its parameter group (PGN {parameter_group(number)}) as {found}: "
                "write this identifier in the DBC, or declare the message as J1939 "
                "(VFrameFormat J1939PG)"
            )
        other = [key for key in self.log.frames if key.identifier == number]
        if other:
            form = "an extended" if other[0].is_extended else "a standard"
            return f"; the log has this number as {form} identifier"
        if not message.is_extended_frame:
            return ""
        near = [
            f"{key.identifier:#x}"
            for key in self.log.frames
            if key.is_extended and _count_differing_digits(key.identifier >> 8, number >> 8) == 1
        ]
        return f"; a similar one is {_join(near)}" if near else ""

    def explain_ambiguous(self, name: str) -> str:
        """Return the longer names of the signals that a name stands for."""
        longest = list(dict.fromkeys(place.names[-1] for place in self.places[name]))
        if len(longest) == 1:
            text = f"the DBC files define `{longest[0]}` several times: name the right file only"
            return text + ", or one for each bus, as in `dbc: {can0: a.dbc, can1: b.dbc}`"
        return f"`column:` in the map names one of them: {_join(f'`{one}`' for one in longest)}"

    def samples(self, name: str) -> Samples:
        """Return the values of a signal by one of its names.

        Frames without the signal (of another multiplexer value), short frames and frames of unknown
        multiplexer values are left out; a value that the database calls missing is None. Raises
        SpecError if no frame remains, and ValueError if the name stands for several signals.
        """
        (place,) = self.places[name]
        signal, frames = place.signal, self.log.frames[place.key]
        if signal.fault:
            label = f"signal `{signal.signal.name}` cannot be read: {signal.fault}"
            hint = MULTIPLEXER_HELP if signal.is_unselectable else ""
            raise SpecError([Problem("empty", Span(self.source, frames[0].line, 1), label, hint)])
        assumed = self._assumptions_of(place)
        whole = [frame for frame in frames if len(frame.data) >= signal.length]
        if len(whole) < len(frames):
            assumed.append(_explain_short(signal, frames))
        if not whole:
            label = f"message `{signal.message.name}` has no whole frame: {assumed[-1].reason}"
            raise SpecError([Problem("empty", Span(self.source, frames[0].line, 1), label)])
        if signal.selector is not None:
            assumed += _unknown_selections(signal, whole)
        used = [frame for frame in whole if signal.is_selected(frame.data)]
        words = [signal.word(frame.data) for frame in used]
        values: list[float | None] = [
            None if NO_VALUE.fullmatch(word) else signal.decode(frame.data)
            for word, frame in zip(words, used, strict=True)
        ]
        for word, number in Counter(filter(NO_VALUE.fullmatch, words)).items():
            value = f"{number} of {len(used)} samples have no value"
            reason = f"the DBC calls them `{word}`"
            assumed.append(Assumption(f"signal `{signal.signal.name}`", value, reason))
        return Samples(
            values,
            lambda k: words[k] or repr(values[k]),
            lambda k: Span(self.source, used[k].line, 1),
            [exact_fraction(frame.time) for frame in used],
            signal.signal.unit or "",
            words if any(words) else (),
            tuple(assumed),
        )

    def _assumptions_of(self, place: _Place) -> list[Assumption]:
        """Return what is assumed of the definition of a signal and of its message."""
        message = place.signal.message
        assumed = []
        if place.by_group:
            reason = f"it has the same parameter group (PGN {parameter_group(message.frame_id)}) "
            reason += f"as {message.frame_id:#x} in the DBC"
            value = f"{place.key.identifier:#x}"
            assumed.append(Assumption(f"message `{message.name}`", value, reason))
        overlapping = place.signal.overlapping
        if overlapping:
            others = _join([f"`{name}`" for name in overlapping])
            reason = f"the DBC lets it overlap with {others} in message `{message.name}`"
            subject = f"signal `{place.signal.signal.name}`"
            assumed.append(Assumption(subject, "read as the DBC states", reason))
        return assumed


def _places_of(
    message: Any, keys: list[FrameKey], by_group: bool, named: set[FrameKey]
) -> Iterator[_Place]:
    """Yield the signals of a message for each of its keys.

    `named` are the keys of all messages of its name: if these differ in identifier or bus, longer
    names contain them.
    """
    has_identifiers = len({(key.identifier, key.is_extended) for key in named}) > 1
    has_buses = len({key.bus for key in named}) > 1
    for key in keys:
        for signal in signals_of(message):
            short = f"{message.name}.{signal.signal.name}"
            names = [signal.signal.name, short]
            if has_identifiers:
                names.append(f"{key.identifier:#x}.{short}")
            if has_buses:
                names.append(f"{key.bus}.{names[-1]}")
            yield _Place(key, signal, tuple(names), by_group)


def _explain_short(signal: CanSignal, frames: list[CanFrame]) -> Assumption:
    """Return that the frames are left out that are shorter than a signal and its message need."""
    short = [frame for frame in frames if len(frame.data) < signal.length]
    first = short[0]
    return Assumption(
        f"frames of message `{signal.message.name}`",
        f"{len(short)} of {len(frames)} left out",
        f"the one at {first.time!r} s has {len(first.data)} bytes, the DBC says {signal.length}",
    )


def _count_differing_digits(first: int, second: int) -> int:
    """Return the number of hexadecimal digits in which two numbers of 6 digits differ."""
    return sum(a != b for a, b in zip(f"{first:06x}", f"{second:06x}", strict=True))


def _unknown_selections(signal: CanSignal, frames: list[CanFrame]) -> list[Assumption]:
    """Return that frames are left out whose multiplexer values no signal of the message has."""
    assumed = []
    selector = signal.selector
    while selector is not None:
        chosen = [frame for frame in frames if selector.is_selected(frame.data)]
        found = Counter(unknown_selection(signal.message, selector, f.data) for f in chosen)
        found.pop(None, None)
        if found:
            values = _join([str(value) for value in sorted(found, key=lambda value: value or 0)])
            reason = f"the DBC does not know the value {values} of the multiplexer "
            reason += f"`{selector.signal.name}`"
            value = f"{found.total()} of {len(frames)} left out"
            assumed.append(Assumption(f"frames of message `{signal.message.name}`", value, reason))
        selector = selector.selector
    return assumed


def _join(names: Iterator[str] | list[str]) -> str:
    """Return the first names (`MAX_SHOWN`), separated by commas, and the number of the others."""
    listed = list(dict.fromkeys(names))
    rest = f" and {len(listed) - MAX_SHOWN} more" if len(listed) > MAX_SHOWN else ""
    return ", ".join(listed[:MAX_SHOWN]) + rest
