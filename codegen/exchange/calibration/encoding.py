"""Encoding of calibration files: reads their bytes and decodes their text."""

from __future__ import annotations

import re
from pathlib import Path

from language.text.diagnostic import Problem, Source, Span, SpecError
from language.text.document import decode_utf8, read_regular_file

MAX_BYTES = 8 * 1024 * 1024
"""Largest file that is read [bytes]; the page of a large automaton has about 100 kB."""
LINE_END = re.compile(r"\r\n|\r|\n")
"""The end of a line on any system."""
CONTROL_CHARACTERS = re.compile(r"[\x00-\x08\x0b\x0e-\x1f]")
"""Control characters that no text contains; tabs, line ends and form feeds are not among them."""
UTF16_BOM = (b"\xff\xfe", b"\xfe\xff")
"""Byte order marks of UTF-16."""


def read_bytes(path: Path, display_name: str) -> bytes:
    """Return the contents of a file; `display_name` names it in messages.

    Raises SpecError for a path that is no readable regular file, for a file larger than MAX_BYTES,
    and for one that is empty or only white space.
    """
    data = read_regular_file(path, display_name, MAX_BYTES, "a page")
    if not data.strip():
        place = Span(Source(display_name), 1, 1)
        raise SpecError([Problem("empty", place, "the file is empty")])
    return data


def decode_text(
    data: bytes, display_name: str, fallback_encoding: str | None = None
) -> tuple[Source, str]:
    """Return the source of a file, split into lines, and its text.

    The text is decoded as UTF-8, without a byte order mark, else in `fallback_encoding` if that is
    not None. Raises SpecError for UTF-16 (by its byte order mark), undecodable bytes and
    CONTROL_CHARACTERS. Any of CR LF, CR and LF ends a line; the text keeps them.
    """
    if data.startswith(UTF16_BOM):
        place = Span(Source(display_name), 1, 1)
        raise SpecError([Problem("binary", place, "this is UTF-16", "save it as UTF-8")])
    try:
        text = decode_utf8(data, display_name)
    except SpecError:
        if fallback_encoding is None:
            raise
        text = data.decode(fallback_encoding)
    control_character = CONTROL_CHARACTERS.search(text)
    if control_character:
        line = len(LINE_END.findall(text, 0, control_character.start())) + 1
        place = Span(Source(display_name), line, 1)
        label = f"this is no text: it holds the character {ord(control_character[0])}"
        raise SpecError([Problem("binary", place, label)])
    return Source(display_name, tuple(LINE_END.split(text))), text
