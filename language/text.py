"""Text: free texts of specs and names of files, made harmless for the line they are printed in."""

from __future__ import annotations

import unicodedata

UNSEEN = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
"""Categories of Unicode that draw nothing, turn the direction of text or end a line."""
LONGEST_LINE = 160
"""Characters of a line shown to a person; longer ones are cut around what is meant."""


def visible(text: str) -> str:
    """Return a text in which every character that is not seen is written as an escape."""
    return "".join(_escaped(c) if unicodedata.category(c) in UNSEEN else c for c in text)


def one_for_one(text: str) -> str:
    """Return a text of equal length without characters that are not seen, for carets below it."""
    kept = (" " if c == "\t" else c for c in text)
    return "".join("\ufffd" if unicodedata.category(c) in UNSEEN else c for c in kept)


def shortened(text: str, longest: int = LONGEST_LINE) -> str:
    """Return a text of at most so many characters."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


def around(text: str, column: int, width: int) -> tuple[str, int, int]:
    """Return the part of a long line around a place, and the place's column and width in it."""
    if len(text) <= LONGEST_LINE:
        return text, column, width
    start = max(0, column - 1 - LONGEST_LINE // 4)
    part = text[start : start + LONGEST_LINE]
    return part, column - start, min(width, len(part) - (column - start) + 1)


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"
