"""Recording window: parses paths that name a time window [s] of a file, like `run.csv@0..12.5`."""

from __future__ import annotations

import filecmp
import os
import re
from fractions import Fraction
from pathlib import Path

from language.model.system import RecordingMap, Window
from language.text.diagnostic import Problems

PART_PATTERN = re.compile(r"(?P<file>.+)@(?P<start>\d+(?:\.\d+)?)\.\.(?P<end>\d+(?:\.\d+)?)")
"""Pattern of a file name with a window: name, start and end."""


def strip_window_suffix(path: Path) -> Path:
    """Return the path without its time window."""
    return split_window_suffix(path)[0]


def split_window_suffix(path: Path) -> tuple[Path, Window | None]:
    """Return the file of a path and its time window [s]; None if the path names no window.

    An existing file whose own name has this form is taken as a whole.
    """
    match = PART_PATTERN.fullmatch(path.name)
    if not match or path.exists():
        return path, None
    return path.with_name(match["file"]), (Fraction(match["start"]), Fraction(match["end"]))


def windows_in_use(path: Path, mapping: RecordingMap, problems: Problems) -> tuple[Window, ...]:
    """Return the time windows [s] of a path: those of the map, intersected with that of the path.

    An empty tuple means the whole recording. An empty intersection is reported.
    """
    file, part = split_window_suffix(path)
    windows = mapping.windows_of(file.name)
    if part is None:
        return windows
    if not windows:
        windows = (part,)
    both = tuple((max(start, part[0]), min(end, part[1])) for start, end in windows)
    result = tuple((start, end) for start, end in both if start < end)
    if not result:
        label = f"nothing of `{path.name}` is in a window of this map"
        problems.error("range", mapping.span, label, "`FILE@0..12.5` is from 0 s to 12.5 s")
    return result


def paths_overlap(first: Path, second: Path, compare_contents: bool = True) -> bool:
    """Return whether two paths have values in common.

    They have if they name the same file, or copies of it, and their time windows overlap. Copies
    are recognised only if `compare_contents` is true.
    """
    (first_file, a), (second_file, b) = split_window_suffix(first), split_window_suffix(second)
    if os.path.realpath(first_file) != os.path.realpath(second_file) and not (
        compare_contents and is_copy(first_file, second_file)
    ):
        return False
    return a is None or b is None or max(a[0], b[0]) < min(a[1], b[1])


def is_copy(first: Path, second: Path) -> bool:
    """Return whether two files have the same bytes; False if one cannot be read."""
    try:
        return filecmp.cmp(first, second, shallow=False)
    except OSError:
        return False
