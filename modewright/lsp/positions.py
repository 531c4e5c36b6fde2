"""Positions: convert places of specs to positions of the protocol, which count from 0.

Columns are counted in code units of the encoding that was agreed with the editor.
"""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import unquote, urlsplit

from lsprotocol import types

from language.text.diagnostic import Span

CODECS = {"utf-8": ("utf-8", 1), "utf-16": ("utf-16-le", 2), "utf-32": ("utf-32-le", 4)}
"""The encodings of the protocol: codec and bytes of a code unit."""


def range_of(span: Span, encoding: str) -> types.Range:
    """Return the range of a span, on its first line only, with columns clipped to that line."""
    line = max(0, span.line - 1)
    lines = span.source.lines
    text = lines[line] if line < len(lines) else ""
    start = encoded_column(text, span.column - 1, encoding)
    end = encoded_column(text, span.column - 1 + span.width, encoding)
    return types.Range(types.Position(line, start), types.Position(line, max(end, start)))


def contains_position(span: Span, position: types.Position, encoding: str) -> bool:
    """Return whether a span contains a position, its start and its end included."""
    found = range_of(span, encoding)
    return found.start.line == position.line and (
        found.start.character <= position.character <= found.end.character
    )


def column_of(text: str, position: types.Position, encoding: str) -> int:
    """Return the number of characters before a position in its line `text`; clipped to the line."""
    codec, width = CODECS[encoding]
    encoded = text.encode(codec, errors="replace")
    return len(encoded[: width * position.character].decode(codec, errors="replace"))


def source_text(span: Span) -> str:
    """Return the text of a span in its source; empty if its line does not exist."""
    lines = span.source.lines
    text = lines[span.line - 1] if 0 < span.line <= len(lines) else ""
    return text[span.column - 1 : span.column - 1 + span.width]


def path_of(uri: str) -> Path:
    """Return the resolved path of a `file:` URI, with percent escapes decoded.

    A URI of another scheme, like `untitled:` or `git:`, gives a path below a folder that has the
    name of the scheme, at which there is no file. So its text does not replace that of a file.
    """
    parts = urlsplit(uri)
    if parts.scheme != "file":
        rest = unquote(uri.removeprefix(f"{parts.scheme}:")).lstrip("/")
        return (Path(os.sep) / f"{parts.scheme}:" / rest).resolve()
    path = unquote(parts.path)
    return Path(path.removeprefix("/") if os.name == "nt" else path).resolve()  # nt: `/C:/...`


def uri_of(path: Path) -> str:
    """Return the `file:` URI of the resolved path."""
    return path.resolve().as_uri()


def encoded_column(text: str, count: int, encoding: str) -> int:
    """Return the number of code units of the first `count` characters of a line; clipped to it."""
    codec, width = CODECS[encoding]
    return len(text[: max(0, count)].encode(codec, errors="replace")) // width
