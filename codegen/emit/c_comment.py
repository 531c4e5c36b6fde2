"""Comment: any text inside `/* ... */`: ASCII, one line, nothing that ends or continues it."""

from __future__ import annotations

import re

from language.text.sanitise import escape_invisible, truncate

MAX_COMMENT_LENGTH = 120
"""Longest text of a comment [characters]; `about` of a spec may be a paragraph."""


def sanitise_comment(text: str) -> str:
    """Return a text that is safe in a C comment, whatever it holds (rule C21).

    Without `*/` and `/*`, without trigraphs (`??/` is a backslash: C99 5.2.1.1), without a
    backslash at its end, without line ends; other alphabets are written as escapes.
    """
    line = " ".join(escape_invisible(" ".join(text.split())).split())
    ascii_line = line.encode("ascii", "backslashreplace").decode("ascii")
    cut = truncate(ascii_line, MAX_COMMENT_LENGTH)
    apart = re.sub(r"(?<=\*)(?=/)|(?<=/)(?=[*/])|(?<=\?)(?=\?)", " ", cut)
    return apart.rstrip("\\ ")
