"""Recorded part: a file named with the time [s] to use of it, like `run.csv@0..12.5`."""

from __future__ import annotations

import filecmp
import os
import re
from fractions import Fraction
from pathlib import Path

from language.model.system import RecordingMap, Window
from language.text.diagnostic import Problems

PART_PATTERN = re.compile(r"(?P<file>.+)@(?P<start>\d+(?:\.\d+)?)\.\.(?P<end>\d+(?:\.\d+)?)")


def file_of(path: Path) -> Path:
    """Return the file of a path that may name a part of it."""
    return part_of(path)[0]


def part_of(path: Path) -> tuple[Path, Window | None]:
    """Return the file of a path and the part of it [s] that is named, None if it is all of it.

    A file that is itself called like that is taken as it is.
    """
    match = PART_PATTERN.fullmatch(path.name)
    if not match or path.exists():
        return path, None
    return path.with_name(match["file"]), (Fraction(match["start"]), Fraction(match["end"]))


def windows_of(path: Path, mapping: RecordingMap, problems: Problems) -> tuple[Window, ...]:
    """Return the times to use of a path: those of the map, as far as they lie in its part."""
    file, part = part_of(path)
    windows = mapping.windows_of(file.name)
    if part is None:
        return windows
    if not windows:
        windows = (part,)
    both = tuple((max(start, part[0]), min(end, part[1])) for start, end in windows)
    found = tuple((start, end) for start, end in both if start < end)
    if not found:
        label = f"nothing of `{path.name}` is in a window of this map"
        problems.error("range", mapping.span, label, "`FILE@0..12.5` is from 0 s to 12.5 s")
    return found


def overlap(first: Path, second: Path, compare_contents: bool = True) -> bool:
    """Tell whether two paths name the same values: the same file or a copy, with a common time.

    Where they may not be `compare_contents` yet, a copy is taken for another file.
    """
    (one, a), (other, b) = part_of(first), part_of(second)
    if os.path.realpath(one) != os.path.realpath(other) and not (
        compare_contents and is_copy(one, other)
    ):
        return False
    return a is None or b is None or max(a[0], b[0]) < min(a[1], b[1])


def is_copy(first: Path, second: Path) -> bool:
    """Tell whether two files hold the same bytes; one that cannot be read is no copy."""
    try:
        return filecmp.cmp(first, second, shallow=False)
    except OSError:
        return False
