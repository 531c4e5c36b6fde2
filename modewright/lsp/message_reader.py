"""Message reader: splits the input of the language server into messages by their headers.

After a header without a valid length, the next message begins at the next valid header.
"""

from __future__ import annotations

import re
from typing import BinaryIO

CONTENT_LENGTH = re.compile(rb"content-length[ \t]*:[ \t]*(\d{1,9})[ \t]*\r?\n?\Z", re.IGNORECASE)
"""Header with a length at the end of a line; rests of an invalid message may be before it."""
MAX_HEADER_BYTES = 65536
"""Largest part of a line that is read at once; a header is shorter."""
MAX_BODY_BYTES = 256 * 1024 * 1024
"""Largest message; a longer one is taken as a wrong length."""


class HeaderError(ValueError):
    """A message has no valid header; the message of the error says why."""


class MessageReader:
    """Reader of the messages in a binary stream."""

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream
        self.is_lost = False

    def read_body(self) -> bytes | None:
        """Return the bytes of the next message; None at the end of the stream.

        Empty lines before a header are ignored. Raises HeaderError once for a header without a
        valid length; the next call looks for the next valid header.
        """
        length, has_header = None, False
        while line := self.stream.readline(MAX_HEADER_BYTES):
            match = CONTENT_LENGTH.search(line)
            if match:
                length = int(match[1])
            elif line.strip():
                has_header = True  # another header, or the rest of an invalid message
            elif length is None and (self.is_lost or not has_header):
                continue
            elif length is not None and 0 < length <= MAX_BODY_BYTES:
                self.is_lost = False
                return self.stream.read(length)
            else:
                self.is_lost = True
                raise HeaderError(_describe(length))
        return None


def _describe(length: int | None) -> str:
    """Return what is wrong with the length of a header."""
    if length is None:
        return "the header has no line `Content-Length: <number of bytes>`"
    return f"`Content-Length: {length}` is not from 1 to {MAX_BODY_BYTES}"
