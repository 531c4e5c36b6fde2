"""Sanitising: user-supplied texts made safe for output on one line of a terminal."""

from __future__ import annotations

import re
import unicodedata

INVISIBLE_CATEGORIES = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
"""Unicode categories of characters that are invisible, turn the direction or end a line."""
TAB_OR_LINE_FEED = re.compile(r"[\t\n]")
"""The control characters that the output of a command may contain."""
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
"""First characters of the cells of CSV that spreadsheet programs evaluate as formulas."""
MAX_LINE_LENGTH = 160
"""Longest source line in a message [characters]; longer lines are cropped around the place."""


def escape_invisible(text: str) -> str:
    r"""Return a text with invisible characters as escapes like `\x1b` or `\u200b`.

    Invisible are the characters of INVISIBLE_CATEGORIES, tabs and line ends included. Those below
    U+0100 have two hexadecimal digits, the others at least four.
    """
    return "".join(
        _escape(c) if unicodedata.category(c) in INVISIBLE_CATEGORIES else c for c in text
    )


def escape_output(text: str) -> str:
    r"""Return a text of one or more lines as `escape_invisible`, but keep tabs and line feeds.

    Commands print each text through this function, so no text of a user can control the terminal.
    """
    if all(part.isprintable() for part in TAB_OR_LINE_FEED.split(text)):
        return text  # faster
    return "".join(c if c in "\t\n" else escape_invisible(c) for c in text)


def escape_formula(text: str) -> str:
    """Return the text of a cell of CSV that no spreadsheet program takes for a formula.

    A text that starts with one of FORMULA_STARTS gets a single quote before it. Numbers are
    unchanged.
    """
    if not text.startswith(FORMULA_STARTS):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


def mask_invisible(text: str) -> str:
    """Return a text of the same length with tabs as blanks and invisible characters as U+FFFD.

    Invisible are the characters of INVISIBLE_CATEGORIES. Carets printed below the text stay
    aligned.
    """
    characters = (" " if c == "\t" else c for c in text)
    return "".join(
        "\ufffd" if unicodedata.category(c) in INVISIBLE_CATEGORIES else c for c in characters
    )


def truncate(text: str, max_length: int = MAX_LINE_LENGTH) -> str:
    """Return a text cut to at most `max_length` characters; a text that is cut ends in `...`.

    The dots are part of the length.
    """
    return text if len(text) <= max_length else text[: max_length - 3] + "..."


def crop_line(text: str, column: int, width: int) -> tuple[str, int, int]:
    """Return the part of a line that is printed around a place, and the place within the part.

    The result is (part, column, width); columns count from 1. A line of up to MAX_LINE_LENGTH
    characters is returned unchanged. Of a longer one the part starts a quarter of MAX_LINE_LENGTH
    before the place, or at the start of the line, has at most MAX_LINE_LENGTH characters and no
    dots; the width ends at the end of the part.
    """
    if len(text) <= MAX_LINE_LENGTH:
        return text, column, width
    start = max(0, column - 1 - MAX_LINE_LENGTH // 4)
    part = text[start : start + MAX_LINE_LENGTH]
    return part, column - start, min(width, len(part) - (column - start) + 1)


def _escape(character: str) -> str:
    r"""Return a character as `\xNN` below U+0100, else as `\uNNNN`."""
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"
