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
    """Return the path without its time window `@START..END`; see `split_window_suffix`."""
    return split_window_suffix(path)[0]


def split_window_suffix(path: Path) -> tuple[Path, Window | None]:
    """Return the file of a path `FILE@START..END` and its time window [s], exactly.

    The window is None for a path of another form, and for an existing file whose own name has this
    form. The ends are decimal numbers without sign or exponent; their order is not checked.
    """
    match = PART_PATTERN.fullmatch(path.name)
    if not match or path.exists():
        return path, None
    return path.with_name(match["file"]), (Fraction(match["start"]), Fraction(match["end"]))


def windows_in_use(path: Path, mapping: RecordingMap, problems: Problems) -> tuple[Window, ...]:
    """Return the time windows [s] of a path: those of the map, intersected with that of the path.

    The map's windows are those for the name of the file; without them the window of the path is
    taken, and an empty tuple means the whole recording. Empty intersections are dropped; if all are
    empty, this is reported as an error and the result is empty.
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

    They have if they name the same file, or files with the same bytes if `compare_contents` is
    true, and their time windows overlap by more than an instant. A path without a window covers the
    whole file. Windows of maps are not considered.
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
