"""Escaping stream: what commands print to stdout and stderr cannot control the terminal.

Texts of specs, names of files and messages of libraries may contain escape sequences, or characters
that turn the direction of the text.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from language.text.sanitise import escape_output


class EscapingStream:
    """Text stream that escapes the texts that are written (`escape_output`).

    All but the writing is that of `rich_proxied_file`, the stream to which it writes. Rich finds
    that stream by this name and writes its colours to it; `EscapingConsole` escapes its texts.
    """

    def __init__(self, stream: Any) -> None:
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write a text with escapes; return the number of its characters."""
        self.rich_proxied_file.write(escape_output(text))
        return len(text)

    def writelines(self, lines: Iterator[str]) -> None:
        """Write texts with escapes."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the stream."""
        return getattr(self.rich_proxied_file, name)


@contextmanager
def escape_standard_streams() -> Iterator[None]:
    """Return a context in which stdout and stderr are escaping streams; missing ones are not."""
    before = sys.stdout, sys.stderr
    streams = (stream if stream is None else EscapingStream(stream) for stream in before)
    sys.stdout, sys.stderr = streams
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
