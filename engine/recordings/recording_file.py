"""Recorded file: the common interface of all recording formats, a set of named sample sequences."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from language.text.diagnostic import Problem, Source, Span, SpecError
from language.text.regular_file import NOT_REGULAR, open_regular_file

MAX_BYTES = 512 * 1024 * 1024
"""Largest size of a recording, after decompression."""
MAX_PROBLEMS = 20
"""Number of reported problems after which values are not checked further."""

NO_VALUE = re.compile(
    r"sna|signal[ _]?not[ _]?available|not[ _]?available|not[ _]?valid|invalid|n/?a|error|"
    r"undefined|no[ _]?value|no[ _]?data",
    re.IGNORECASE,
)
"""Words for a missing value in the value tables of DBC and MF4 files."""
LFS_MARK = b"version https://git-lfs.github.com/spec/"
"""First bytes of a pointer of Git LFS, which stands for a file that is not fetched yet."""
LFS_HELP = "`git lfs pull` fetches the file itself"
"""What helps if a file is a pointer of Git LFS."""


@dataclass(frozen=True)
class Assumption:
    """What a reader has taken of a file that neither the file nor the map states.

    `subject` is for example `separator`, `value` is `semicolon`, and `reason` the evidence. It is
    also what the reader left out, with the reason.
    """

    subject: str
    value: str
    reason: str

    @property
    def text(self) -> str:
        """The assumption as a line of a message."""
        return f"assumed of the recording: {self.subject}: {self.value} ({self.reason})"


@dataclass(frozen=True)
class Samples:
    """Samples under one name, in the order of the file.

    `values` are None for an empty cell, and not finite if `text` is no finite number. `text` and
    `place` give the text and the place of a sample by index; in a binary format the row or sample
    number stands for the line. `stamps` [s] are the time stamps of the samples; None if the rows
    share a time column. `unit` is the unit text of the file. `words` are the words of the file for
    the numbers, empty if it has none. `assumptions` also tell what is left out.
    """

    values: Sequence[float | None]
    text: Callable[[int], str]
    place: Callable[[int], Span]
    stamps: Sequence[Fraction] | None = None
    unit: str = ""
    words: Sequence[str] = ()
    assumptions: tuple[Assumption, ...] = ()


@dataclass(frozen=True)
class RecordedFile:
    """File of measurements with named columns, channels or signals.

    `noun` is the word for these in messages. `read` returns the samples of a name. `is_stamped`
    tells whether each name has its own time stamps. `explain_missing` returns a hint for a missing
    name, `explain_ambiguous` one for a name that occurs several times, or an empty text.
    `head_line` is the number of the line with the names. `assumptions` are what the reader has
    taken of the whole file.
    """

    source: Source
    noun: str
    names: Sequence[str]
    read: Callable[[str], Samples]
    rows: int
    is_stamped: bool = False
    explain_missing: Callable[[str], str] = lambda name: ""
    explain_ambiguous: Callable[[str], str] = lambda name: ""
    head_line: int = 1
    assumptions: tuple[Assumption, ...] = ()

    @property
    def header_span(self) -> Span:
        """Place of the names: the whole head line of the file; a binary file has one character."""
        lines = self.source.lines
        length = len(lines[self.head_line - 1]) if lines else 1
        return Span(self.source, self.head_line, 1, max(1, length))


def require_size(path: Path, source: Source) -> None:
    """Raise SpecError if a file cannot be opened, is empty or is larger than `MAX_BYTES`."""
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise unreadable_error(source, f"read: {error.strerror or error}") from None
    if size > MAX_BYTES:
        raise SpecError(
            [Problem("huge", Span(source, 1, 1), f"the recording is larger than {MAX_BYTES} bytes")]
        )
    if not size:
        raise SpecError([Problem("empty", Span(source, 1, 1), "the recording is empty")])


def is_lfs_pointer(data: bytes) -> bool:
    """Return whether the bytes of a file are those of a pointer of Git LFS."""
    return data.startswith(LFS_MARK)


def require_regular_file(path: Path, source: Source) -> None:
    """Raise SpecError for a folder, for a pipe or a device, and for a pointer of Git LFS.

    A pipe or a device may be endless. Files that are missing or may not be read pass; the reader
    reports them.
    """
    try:
        with open_regular_file(path) as file:
            data = file.read(len(LFS_MARK))
        if is_lfs_pointer(data):
            action = "read: it is a pointer of Git LFS, and not the file"
            raise unreadable_error(source, action, LFS_HELP)
    except OSError as error:
        if error.strerror == NOT_REGULAR:
            raise unreadable_error(
                source, f"read: {NOT_REGULAR}", "write its content into a file first"
            ) from None


def unreadable_error(source: Source, action: str, help: str = "") -> SpecError:
    """Return the error `the recording cannot be <action>` at line 1 of the source.

    `action` is a participle with its reason, as in `read: no access`; `help` is the hint.
    """
    return SpecError(
        [Problem("unreadable", Span(source, 1, 1), f"the recording cannot be {action}", help)]
    )


def exact_fraction(value: float) -> Fraction:
    """Return the shortest decimal that reads back as a floating-point number, as a fraction.

    Raises ValueError if the number is not finite.
    """
    return Fraction(repr(float(value)))


def first_line(error: Exception) -> str:
    """Return the first line of an error message, or the name of the error."""
    text = str(error).strip().splitlines()
    return text[0].rstrip(".") if text else type(error).__name__
