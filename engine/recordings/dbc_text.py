"""DBC text: the statements of a DBC file that decoding needs, in the form that cantools reads.

Real files break the rules of the format in a few ways that leave their meaning clear. These are
repaired and told, so that a message is not lost: extended identifiers without their bit, numbers
without a leading zero, and names that begin with a digit. Comments and attributes are left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from engine.recordings.frame_text import MAX_EXTENDED, MAX_STANDARD, decode_text
from engine.recordings.recording_file import Assumption
from language.text.sanitise import truncate

STATEMENT = re.compile(r'[ \t]*([A-Z][A-Z_]*_|VERSION)(?=[\s:"]|$)')
"""Keyword at the start of a statement."""
STRING = re.compile(r'("(?:[^"\\]|\\.)*")', re.DOTALL)
"""A string of a DBC file."""
DECODING = ("BO_", "SG_", "VAL_", "SIG_VALTYPE_", "SG_MUL_VAL_")
"""Keywords of the statements that say how frames are decoded."""
PROTOCOL = re.compile(r'\s*BA_(?:DEF_|DEF_DEF_)?\s+(?:BO_\s+)?"VFrameFormat"')
"""An attribute statement that says whether a message is one of J1939."""
LONG_NAME = re.compile(
    r'\s*BA_\s+"System(?:Message|Signal)LongSymbol"\s+'
    r'(?:BO_\s+(?P<message>\d+)|SG_\s+(?P<id>\d+)\s+(?P<signal>\w+))\s+"(?P<name>[^"]+)"'
)
"""An attribute statement with a name of more than 32 characters."""
COMMENT = re.compile(r'"(?:[^"\\]|\\.)*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
"""A string, or a comment of C, which some tools accept in DBC files."""
LEADING_POINT = re.compile(r"(?<=[(\[,|\s])([-+]?)\.(?=\d)")
"""A number without a digit in front of its point."""
PLUS_SIGN = re.compile(r"(?<=[(\[,|])(\s*)\+(?=[\d.])")
"""A number with a sign that cantools does not read."""
NAME = re.compile(
    r"(?P<head>\s*(?:BO_\s+\d+|SG_|(?:VAL_|SIG_VALTYPE_|SG_MUL_VAL_)\s+\d+)\s+)"
    r"(?P<name>\w+)(?P<parent>\s+\w+(?=\s+\d+\s*-))?"
)
"""The start of a statement up to the name that it defines or describes."""
DIGIT_PREFIX = "digit__"
"""Prefix of a name that begins with a digit, while cantools reads the file."""
SELECTED = re.compile(r"\s*SG_\s+(?P<name>\w+)\s+m(?P<value>\d+)M?\s*:")
"""The start of a signal that a value of a multiplexer selects."""
IDENTIFIER = re.compile(r"(?P<head>\s*(?:BO_|VAL_|SIG_VALTYPE_|SG_MUL_VAL_)\s+)(?P<number>\d+)\b")
"""The start of a statement up to the identifier of its message."""
PROTOCOL_IDENTIFIER = re.compile(r'(?P<head>\s*BA_\s+"VFrameFormat"\s+BO_\s+)(?P<number>\d+)\b')
"""The start of an attribute statement up to the identifier of its message."""
SIGNAL_BITS = re.compile(r"\s*SG_\s[^:\"]*:\s*(?P<start>-?\d+)\s*\|\s*(?P<length>\d+)\s*@")
"""The start of a signal up to its first bit and its number of bits."""
BYTE_ORDER = re.compile(r"\s*SG_\s[^:\"]*:[^@\"]*@\s*[01]\s*[+-]")
"""The start of a signal up to its byte order and sign."""
MESSAGE_LENGTH = re.compile(r"\s*BO_\s+\d+\s+[^:\"]*:\s*(?P<length>-?\d+)")
"""The start of a message up to its number of bytes."""
MAX_BITS = 8 * 4095
"""Number of bits of the longest message of a transport protocol.

cantools needs a time in proportion to the number of a message.
"""
EXTENDED_BIT = 1 << 31
"""Bit of an identifier in a DBC file that marks an extended one."""
NO_FRAME = "VECTOR__INDEPENDENT_SIG_MSG"
"""Name of the message of signals that no frame contains."""


@dataclass
class DbcText:
    """Lines of a DBC file without the statements that decoding does not need.

    The lines keep their numbers. `selected` are the multiplexer values of signals by the name of
    their message and their own. `long_names` are the names of messages by (identifier, ""), and of
    signals by (identifier, name). `left_out` are sentences on statements that have no meaning,
    `assumptions` what is taken of the file.
    """

    lines: list[str]
    selected: dict[tuple[str, str], int] = field(default_factory=dict)
    long_names: dict[tuple[int, str], str] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    assumptions: list[Assumption] = field(default_factory=list)

    def complete(self, messages: list[Any]) -> None:
        """Give messages and signals of cantools the names that the file gives them.

        A signal that cantools takes for one of all frames, although a value of a multiplexer
        selects it, gets this value, and the multiplexer of its message if that has a single one.
        """
        for message in messages:
            roots = [
                signal.name
                for signal in message.signals
                if signal.is_multiplexer and (message.name, signal.name) not in self.selected
            ]
            for signal in message.signals:
                value = self.selected.get((message.name, signal.name))
                if value is not None and not signal.multiplexer_ids:
                    signal.multiplexer_ids = [value]
                    signal.multiplexer_signal = roots[0] if len(roots) == 1 else None
            number = message.frame_id | (EXTENDED_BIT if message.is_extended_frame else 0)
            names = {s.name: self._name(number, s.name) for s in message.signals}
            for signal in message.signals:
                signal.name = names[signal.name]
                parent = signal.multiplexer_signal
                signal.multiplexer_signal = names.get(parent, parent)
            message.name = self.long_names.get((number, ""), _strip_prefix(message.name))

    def _name(self, number: int, name: str) -> str:
        """Return the name of a signal that cantools knows by another one."""
        written = _strip_prefix(name)
        return self.long_names.get((number, written), written)


def read_dbc_text(data: bytes, name: str) -> DbcText:
    """Return the lines of a DBC file that decoding needs; `name` is its name in assumptions.

    Raises ValueError if the file has no statement.
    """
    text = DbcText(_remove_comments(decode_text(data)).splitlines())
    bounds = list(find_statements(text.lines))
    if not bounds:
        raise ValueError("it has no statement of a DBC")
    extended: dict[int, int] = {}
    is_kept, message = None, ""
    for start, end in bounds:
        lines = text.lines[start:end]
        keyword = _keyword(lines[0])
        statement = "\n".join(lines)
        if keyword == "BO_":
            is_kept = _note_message(statement, start, extended, text)
        if keyword == "SG_" and not is_kept:
            if is_kept is None:
                why = "is a signal without a message"
                text.left_out.append(explain_left_out(start, statement, why))
            text.lines[start:end] = [""] * (end - start)
        elif keyword == "SG_" and (why := _explain_signal(statement)):
            text.left_out.append(explain_left_out(start, statement, why))
            text.lines[start:end] = [""] * (end - start)
        elif (keyword == "BO_" and not is_kept) or not _is_needed(statement, keyword):
            _note_long_name(statement, text)
            text.lines[start:end] = [""] * (end - start)
        else:
            statement = _repair(statement)
            text.lines[start:end] = statement.split("\n")
            if keyword == "BO_":
                message = next(iter(statement.split()[2:]), "").rstrip(":")
            elif match := SELECTED.match(statement):
                text.selected[message, match["name"]] = int(match["value"])
    before = bounds[0][0]
    text.lines[:before] = [""] * before
    _mark_extended(text, extended, name)
    return text


def find_statements(lines: list[str]) -> Iterator[tuple[int, int]]:
    """Yield the first line and the line behind the last one of each statement, counted from 0.

    Strings go over several lines and contain any text, unless a quotation mark of the file has no
    partner.
    """
    has_strings = sum(line.count('"') - line.count('\\"') for line in lines) % 2 == 0
    start, in_string = -1, False
    for k, line in enumerate(lines):
        if not in_string and STATEMENT.match(line):
            if start >= 0:
                yield start, k
            start = k
        if has_strings and (line.count('"') - line.count('\\"')) % 2:
            in_string = not in_string
    if start >= 0:
        yield start, len(lines)


def explain_left_out(
    start: int, statement: str, why: str = "does not fit the others or is no statement of a DBC"
) -> str:
    """Return a sentence with the place and the first words of a statement that is left out."""
    return f"line {start + 1} (`{' '.join(statement.split()[:3])}`) {why}"


def _keyword(line: str) -> str:
    """Return the keyword of the first line of a statement."""
    return STATEMENT.match(line)[1]  # type: ignore[index]


def _remove_comments(text: str) -> str:
    """Return a text with blanks for comments of C outside of strings; the lines stay."""
    if "//" not in text and "/*" not in text:
        return text

    def blank(match: re.Match[str]) -> str:
        found = match[0]
        return found if found.startswith('"') else "\n" * found.count("\n")

    return COMMENT.sub(blank, text)


def _is_needed(statement: str, keyword: str) -> bool:
    """Return whether decoding needs a statement: by its keyword, or a message follows in it.

    The list of new symbols (`NS_`) has keywords alone in a line.
    """
    bare = STRING.sub("", statement)
    if keyword in DECODING:
        return bare.strip() != keyword
    return bool(PROTOCOL.match(statement)) or bool(re.search(r"\sBO_\s+\d+\s+\w+\s*:", bare))


def _explain_signal(statement: str) -> str:
    """Return why a signal has no meaning, as a clause; empty for others."""
    match = SIGNAL_BITS.match(statement)
    if match is None:
        return ""
    start, length = int(match["start"]), int(match["length"])
    if start < 0 or start + length > MAX_BITS:
        return f"has bits outside of a message of {MAX_BITS // 8} bytes"
    if BYTE_ORDER.match(statement) is None:
        return "does not state the order of its bytes and its sign, as in `@1+`"
    return ""


def _note_message(statement: str, start: int, extended: dict[int, int], text: DbcText) -> bool:
    """Note an identifier that lacks the bit of extended ones; return whether a message can be read.

    It has an identifier of CAN and a number of bytes that a message can have.
    """
    match = IDENTIFIER.match(statement)
    if match is None:
        return bool(statement.strip() != "BO_")
    number = int(match["number"])
    if MAX_STANDARD < number <= MAX_EXTENDED:
        extended.setdefault(number, start + 1)
    elif number & ~EXTENDED_BIT > MAX_EXTENDED:
        if NO_FRAME not in statement:
            why = "has an identifier of more than 29 bits"
            text.left_out.append(explain_left_out(start, statement, why))
        return False
    length = MESSAGE_LENGTH.match(statement)
    if length and not 0 <= int(length["length"]) <= MAX_BITS // 8:
        why = f"has {truncate(length['length'])} bytes; a message has 0 to {MAX_BITS // 8}"
        text.left_out.append(explain_left_out(start, statement, why))
        return False
    return True


def _note_long_name(statement: str, text: DbcText) -> None:
    """Note the long name that an attribute statement gives."""
    match = LONG_NAME.match(statement)
    if match:
        key = (int(match["message"] or match["id"]), match["signal"] or "")
        text.long_names[key] = match["name"]


def _repair(statement: str) -> str:
    """Return a statement with numbers and names that cantools reads."""
    parts = STRING.split(statement)
    for k in range(0, len(parts), 2):  # the parts between are strings
        parts[k] = LEADING_POINT.sub(r"\g<1>0.", parts[k])
        parts[k] = PLUS_SIGN.sub(r"\1", parts[k])
    match = NAME.match(parts[0])
    if match:
        parent = match["parent"] or ""
        blanks = parent[: len(parent) - len(parent.lstrip())]
        names = _add_prefix(match["name"]) + blanks + _add_prefix(parent.strip())
        parts[0] = match["head"] + names + parts[0][match.end() :]
    return "".join(parts)


def _add_prefix(name: str) -> str:
    """Return a name that begins with a digit with a prefix, so that it is a name."""
    return DIGIT_PREFIX + name if name[:1].isdigit() else name


def _strip_prefix(name: str) -> str:
    """Return a name as the file writes it."""
    return name.removeprefix(DIGIT_PREFIX)


def _mark_extended(text: DbcText, extended: dict[int, int], name: str) -> None:
    """Give identifiers of more than 11 bits the bit of extended ones, in all statements."""
    if not extended:
        return

    def mark(match: re.Match[str]) -> str:
        number = int(match["number"])
        marked = number | EXTENDED_BIT if number in extended else number
        return f"{match['head']}{marked}"

    for k, line in enumerate(text.lines):
        marked = IDENTIFIER.sub(mark, line, count=1) if IDENTIFIER.match(line) else line
        text.lines[k] = PROTOCOL_IDENTIFIER.sub(mark, marked, count=1)
    for number, signal in list(text.long_names):
        if number in extended:
            long_name = text.long_names.pop((number, signal))
            text.long_names[number | EXTENDED_BIT, signal] = long_name
    number, line_number = next(iter(extended.items()))
    reason = f"line {line_number}: {number:#x} has more than 11 bits, but not the bit of extended "
    reason += "identifiers"
    value = f"{len(extended)} taken as extended"
    text.assumptions.append(Assumption(f"identifiers of messages in `{name}`", value, reason))
