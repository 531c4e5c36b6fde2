"""Text: free texts of specs and names of files, made harmless for the line they are printed in."""

from __future__ import annotations

import unicodedata

INVISIBLE_CATEGORIES = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
"""Categories of Unicode that draw nothing, turn the direction of text or end a line."""
MAX_LINE_LENGTH = 160
"""Characters of a line shown to a person; longer ones are cut around what is meant."""


def escape_invisible(text: str) -> str:
    """Return a text in which every character that is not seen is written as an escape."""
    return "".join(
        _escape(c) if unicodedata.category(c) in INVISIBLE_CATEGORIES else c for c in text
    )


def mask_invisible(text: str) -> str:
    """Return a text of equal length without characters that are not seen, for carets below it."""
    characters = (" " if c == "\t" else c for c in text)
    return "".join(
        "\ufffd" if unicodedata.category(c) in INVISIBLE_CATEGORIES else c for c in characters
    )


def truncate(text: str, max_length: int = MAX_LINE_LENGTH) -> str:
    """Return a text of at most so many characters."""
    return text if len(text) <= max_length else text[: max_length - 3] + "..."


def crop_line(text: str, column: int, width: int) -> tuple[str, int, int]:
    """Return the part of a long line around a place, and the place's column and width in it."""
    if len(text) <= MAX_LINE_LENGTH:
        return text, column, width
    start = max(0, column - 1 - MAX_LINE_LENGTH // 4)
    part = text[start : start + MAX_LINE_LENGTH]
    return part, column - start, min(width, len(part) - (column - start) + 1)


def _escape(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"
