"""Positions: places of a spec as the protocol counts them, from 0 in units of an encoding."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote, urlparse

from lsprotocol import types

from language.text.diagnostic import Span

CODECS = {"utf-8": ("utf-8", 1), "utf-16": ("utf-16-le", 2), "utf-32": ("utf-32-le", 4)}
"""The encodings of the protocol: the codec and the bytes of one unit."""


def range_of(span: Span, encoding: str) -> types.Range:
    """Return the range of a place; what lies outside its text is cut off."""
    line = max(0, span.line - 1)
    lines = span.source.lines
    text = lines[line] if line < len(lines) else ""
    start = encoded_column(text, span.column - 1, encoding)
    end = encoded_column(text, span.column - 1 + span.width, encoding)
    return types.Range(types.Position(line, start), types.Position(line, max(end, start)))


def contains_position(span: Span, position: types.Position, encoding: str) -> bool:
    """Tell whether a place holds a position, or ends at it."""
    found = range_of(span, encoding)
    return found.start.line == position.line and (
        found.start.character <= position.character <= found.end.character
    )


def column_of(text: str, position: types.Position, encoding: str) -> int:
    """Return the characters of a line that stand before a position."""
    codec, width = CODECS[encoding]
    encoded = text.encode(codec, errors="replace")
    return len(encoded[: width * position.character].decode(codec, errors="replace"))


def source_text(span: Span) -> str:
    """Return the text that stands at a place."""
    lines = span.source.lines
    text = lines[span.line - 1] if 0 < span.line <= len(lines) else ""
    return text[span.column - 1 : span.column - 1 + span.width]


def path_of(uri: str) -> Path:
    """Return the file of an address."""
    return Path(unquote(urlparse(uri).path)).resolve()


def uri_of(path: Path) -> str:
    """Return the address of a file."""
    return path.resolve().as_uri()


def encoded_column(text: str, count: int, encoding: str) -> int:
    """Return where an editor sees a column of a line, from 0."""
    codec, width = CODECS[encoding]
    return len(text[: max(0, count)].encode(codec, errors="replace")) // width
