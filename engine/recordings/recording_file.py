"""Recorded file: what a file of measurements holds under each name, whatever its format."""

from __future__ import annotations

import stat
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from language.text.diagnostic import Problems, Source, Span, SpecError

MAX_BYTES = 512 * 1024 * 1024
"""Largest recording read, unpacked."""
MAX_PROBLEMS = 20
"""After so many problems of values the rest is not looked at."""


@dataclass(frozen=True)
class Samples:
    """What stands under one name, in the order of the file.

    `values` are None where there is none, and not finite where the `text` is no finite number;
    `place` is that of one value: in a text its line, else the number of the row or sample as line.
    `stamps` [s] are its own; None where the rows share columns of time. `unit` is the file's word.
    """

    values: Sequence[float | None]
    text: Callable[[int], str]
    place: Callable[[int], Span]
    stamps: Sequence[Fraction] | None = None
    unit: str = ""


@dataclass(frozen=True)
class RecordedFile:
    """A file of measurements: `noun` is what it calls that which has a name.

    `lacking` says more about a name that is not there, where the format knows more.
    """

    source: Source
    noun: str
    names: Sequence[str]
    read: Callable[[str], Samples]
    rows: int
    is_stamped: bool = False
    explain_missing: Callable[[str], str] = lambda name: ""

    @property
    def head(self) -> Span:
        """The place of the names."""
        lines = self.source.lines
        return Span(self.source, 1, 1, max(1, len(lines[0])) if lines else 1)


def require_size(path: Path, source: Source) -> None:
    """Raise SpecError for a file that cannot be read or is too large."""
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise unreadable_error(source, f"read: {error.strerror or error}") from None
    if size > MAX_BYTES:
        problems = Problems()
        problems.error(
            "huge", Span(source, 1, 1), f"the recording is larger than {MAX_BYTES} bytes"
        )
        raise SpecError(problems.reported)
    if not size:
        problems = Problems()
        problems.error("empty", Span(source, 1, 1), "the recording is empty")
        raise SpecError(problems.reported)


def require_regular_file(path: Path, source: Source) -> None:
    """Raise SpecError for a pipe or a device: it may never end, and can be read only once."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return  # what is wrong is told where it is read
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise unreadable_error(
            source, "read: it is a pipe or a device", "write it into a file first"
        )


def unreadable_error(source: Source, action: str, help: str = "") -> SpecError:
    """Return the error of a file that cannot be read, unpacked or understood."""
    problems = Problems()
    problems.error("unreadable", Span(source, 1, 1), f"the recording cannot be {action}", help)
    return SpecError(problems.reported)


def exact_fraction(value: float) -> Fraction:
    """Return the shortest decimal that stands for a floating-point number, exactly."""
    return Fraction(repr(float(value)))
