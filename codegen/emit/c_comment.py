"""C comments: any text as one line of ASCII that cannot end or continue a comment (rule C21)."""

from __future__ import annotations

import re

from language.text.sanitise import escape_invisible, truncate

MAX_COMMENT_LENGTH = 120
"""Maximum length of the text of a comment [characters]; `about` of a spec may be a paragraph."""


def sanitise_comment(text: str) -> str:
    """Return a text as one line of printable ASCII that is safe between `/*` and `*/` (rule C21).

    White space is collapsed and stripped, other characters become backslash escapes, and the text
    is cut at MAX_COMMENT_LENGTH. Afterwards a blank is put inside `*/`, `/*`, `//` and `??` (`??/`
    is the trigraph of a backslash, C99 5.2.1.1). Backslashes and blanks at the end are removed.
    """
    line = " ".join(escape_invisible(" ".join(text.split())).split())
    ascii_line = line.encode("ascii", "backslashreplace").decode("ascii")
    cut = truncate(ascii_line, MAX_COMMENT_LENGTH)
    apart = re.sub(r"(?<=\*)(?=/)|(?<=/)(?=[*/])|(?<=\?)(?=\?)", " ", cut)
    return apart.rstrip("\\ ")
