"""DBC oracle: reads DBC files and decodes frames by the rules of the format, without any library.

It imports nothing of the product and nothing of cantools, so that both can be compared with it.
Source of the rules: Vector, DBC File Format Documentation, version 1.01 (2007), and for extended
multiplexing its statement `SG_MUL_VAL_`.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

EXTENDED = 1 << 31
"""Bit of the identifier of an extended frame."""
NO_FRAME = 0xC0000000
"""Identifier of the message of signals that no frame contains."""
STRING = r'"(?:[^"\\]|\\.)*"'
"""Pattern of a string of a DBC file."""
COMMENT = re.compile(rf"^[ \t]*CM_\b[^\"]*?{STRING}\s*;", re.MULTILINE | re.DOTALL)
"""Pattern of a comment statement, which may contain any text, also lines like statements."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""Pattern of a decimal number."""
STATEMENT = re.compile(
    rf"""^[ \t]*(?:
    BO_[ \t]+(?P<id>\d+)[ \t]+(?P<message>\w+)[ \t]*:[ \t]*(?P<size>\d+)
    |SG_[ \t]+(?P<signal>\w+)(?:[ \t]+(?P<mux>M|m\d*M?))?[ \t]*:[ \t]*(?P<start>\d+)[ \t]*\|
    [ \t]*(?P<length>\d+)[ \t]*@[ \t]*(?P<order>[01])[ \t]*(?P<sign>[-+])[ \t]*
    \([ \t]*(?P<factor>{NUMBER})[ \t]*,[ \t]*(?P<offset>{NUMBER})[ \t]*\)[ \t]*
    \[[^\]]*\][ \t]*(?P<unit>{STRING})
    |SIG_VALTYPE_[ \t]+(?P<float_id>\d+)[ \t]+(?P<float_signal>\w+)
    [ \t]*:?[ \t]*(?P<float_type>[012])
    |SG_MUL_VAL_[ \t]+(?P<range_id>\d+)[ \t]+(?P<range_signal>\w+)[ \t]+(?P<parent>\w+)[ \t]+
    (?P<ranges>\d+-\d+(?:[ \t,]+\d+-\d+)*)
    |BA_[ \t]+"System(?:Message|Signal)LongSymbol"[ \t]+(?:BO_[ \t]+(?P<long_id>\d+)
    |SG_[ \t]+(?P<long_signal_id>\d+)[ \t]+(?P<short>\w+))[ \t]+"(?P<long>[^"]+)"
    |VAL_[ \t]+(?P<word_id>\d+)[ \t]+(?P<word_signal>\w+)(?P<words>(?:\s+{NUMBER}\s+{STRING})*)
    )""",
    re.MULTILINE | re.VERBOSE,
)
"""Pattern of the statements that describe messages and signals."""
WORD = re.compile(rf"({NUMBER})\s+({STRING})")
"""Pattern of an entry of a value table."""


@dataclass
class OracleSignal:
    """A signal: its bits, its linear conversion, and the values of its multiplexer.

    `ranges` are the values (both ends included) of the signal `parent` that select the signal; a
    signal without a parent is in every frame.
    """

    name: str
    start: int
    length: int
    is_little_endian: bool
    is_signed: bool
    factor: float
    offset: float
    unit: str
    is_multiplexer: bool = False
    parent: str = ""
    ranges: tuple[tuple[int, int], ...] = ()
    is_float: bool = False
    words: dict[int, str] | None = None

    @property
    def bits(self) -> list[int]:
        """The bits of the signal, 8 times the byte plus the bit in it, the lowest bit first.

        A little-endian signal begins at its lowest bit and counts up. A big-endian one begins at
        its highest bit; it goes down in a byte, then to bit 7 of the next byte.
        """
        if self.is_little_endian:
            return list(range(self.start, self.start + self.length))
        bits = [self.start]
        while len(bits) < self.length:
            bits.append(bits[-1] + 15 if bits[-1] % 8 == 0 else bits[-1] - 1)
        return bits[::-1]

    @property
    def bytes_needed(self) -> int:
        """Number of bytes of a frame that contains the signal."""
        return max(self.bits) // 8 + 1

    def raw(self, data: bytes) -> int:
        """Return the bits of the signal as a number without sign."""
        return sum((data[bit // 8] >> bit % 8 & 1) << k for k, bit in enumerate(self.bits))

    def integer(self, data: bytes) -> int:
        """Return the raw number with its sign (two's complement)."""
        raw = self.raw(data)
        return raw - (1 << self.length) if self.is_signed and raw >> self.length - 1 else raw

    def value(self, data: bytes) -> float:
        """Return the value in the unit of the signal."""
        if self.is_float:
            code = {16: "<e", 32: "<f", 64: "<d"}[self.length]
            number = struct.unpack(code, self.raw(data).to_bytes(self.length // 8, "little"))[0]
        else:
            number = self.integer(data)
        return float(number * self.factor + self.offset)

    def write(self, data: bytearray, number: int) -> None:
        """Write a raw number without sign into the bits of the signal."""
        for k, bit in enumerate(self.bits):
            data[bit // 8] &= ~(1 << bit % 8)
            data[bit // 8] |= (number >> k & 1) << bit % 8


@dataclass
class OracleMessage:
    """A message: its identifier, its size [bytes] and its signals in the order of the file."""

    name: str
    identifier: int
    is_extended: bool
    size: int
    signals: list[OracleSignal]

    def signal(self, name: str) -> OracleSignal | None:
        """Return the signal of a name; None without one."""
        return next((one for one in self.signals if one.name == name), None)

    def is_present(self, signal: OracleSignal, data: bytes) -> bool:
        """Return whether a frame contains a signal: all its multiplexers select it."""
        if not signal.parent:
            return True
        parent = self.signal(signal.parent)
        if parent is None or not self.is_present(parent, data):
            return False
        number = parent.raw(data)
        return any(low <= number <= high for low, high in signal.ranges)


def read_dbc(path: Path) -> list[OracleMessage]:
    """Return the messages of a DBC file that frames can have.

    Statements that have not the form of the format are passed over. Later messages of an identifier
    are kept, too.
    """
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
    return parse_dbc(text)


def parse_dbc(text: str) -> list[OracleMessage]:
    """Return the messages of the text of a DBC file."""
    messages: list[OracleMessage] = []
    descriptions = []
    for match in STATEMENT.finditer(COMMENT.sub("", text)):
        if match["id"] is not None:
            number = int(match["id"])
            identifier = -1 if number == NO_FRAME else number & ~EXTENDED
            messages.append(
                OracleMessage(
                    match["message"], identifier, bool(number & EXTENDED), int(match["size"]), []
                )
            )
        elif match["signal"] is None:
            descriptions.append(match)
        elif messages:
            messages[-1].signals.append(_signal(match))
    for match in descriptions:
        _describe_signals(messages, match)
    for message in messages:
        _name_parents(message)
    for match in descriptions:
        _rename(messages, match)
    return [message for message in messages if message.identifier >= 0]


def _describe_signals(messages: Sequence[OracleMessage], match: re.Match[str]) -> None:
    """Take over what a statement says of the type, the multiplexer or the words of a signal."""
    if match["float_id"] is not None and match["float_type"] != "0":
        for signal in _find(messages, match["float_id"], match["float_signal"]):
            signal.is_float = True
    elif match["range_id"] is not None:
        pairs = re.findall(r"(\d+)-(\d+)", match["ranges"])
        for signal in _find(messages, match["range_id"], match["range_signal"]):
            signal.parent = match["parent"]
            signal.ranges = tuple((int(low), int(high)) for low, high in pairs)
    elif match["word_id"] is not None:
        words = WORD.findall(match["words"])
        for signal in _find(messages, match["word_id"], match["word_signal"]):
            signal.words = {int(float(number)): text[1:-1] for number, text in words}


def _signal(match: re.Match[str]) -> OracleSignal:
    """Return the signal of a statement; its parent is set when its message is complete."""
    mux = match["mux"] or ""
    value = re.match(r"m(\d+)", mux)
    return OracleSignal(
        match["signal"],
        int(match["start"]),
        int(match["length"]),
        match["order"] == "1",
        match["sign"] == "-",
        float(match["factor"]),
        float(match["offset"]),
        match["unit"][1:-1],
        mux.endswith("M"),
        "",
        ((int(value[1]), int(value[1])),) if value else (),
    )


def _name_parents(message: OracleMessage) -> None:
    """Set the parents that no `SG_MUL_VAL_` names: the multiplexer that has no value itself."""
    roots = [one.name for one in message.signals if one.is_multiplexer and not one.ranges]
    for signal in message.signals:
        if signal.ranges and not signal.parent and roots:
            signal.parent = roots[0]


def _rename(messages: Sequence[OracleMessage], match: re.Match[str]) -> None:
    """Give a message, or a signal and the signals that it selects, its long name."""
    long, short = match["long"], match["short"]
    if match["long_id"] is not None:
        for message in _of_identifier(messages, match["long_id"]):
            message.name = long
    elif match["long_signal_id"] is not None:
        for message in _of_identifier(messages, match["long_signal_id"]):
            for signal in message.signals:
                signal.name = long if signal.name == short else signal.name
                signal.parent = long if signal.parent == short else signal.parent


def _find(messages: Sequence[OracleMessage], number: str, name: str) -> list[OracleSignal]:
    """Return the signals of a name in the messages of an identifier."""
    found = _of_identifier(messages, number)
    return [signal for message in found for signal in message.signals if signal.name == name]


def _of_identifier(messages: Sequence[OracleMessage], number: str) -> list[OracleMessage]:
    """Return the messages of an identifier as a DBC file writes it."""
    identity = (int(number) & ~EXTENDED, bool(int(number) & EXTENDED))
    return [m for m in messages if (m.identifier, m.is_extended) == identity]
