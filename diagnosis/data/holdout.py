"""Train/test separation: a check that no values are used both for training and for validation."""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from pathlib import Path

from engine.recordings.recording_window import paths_overlap, strip_window_suffix
from language.text.diagnostic import DataError


def require_disjoint(train: Sequence[str | Path], held_out: Sequence[str | Path]) -> None:
    """Raise ValueError if two recordings of a group overlap, or a training and a held-out one.

    Recordings overlap if they are one file (or copies) and their windows intersect; contents of
    held-out files are not opened. A held-out file that cannot be read is an error as well.
    """
    for one, other in itertools.combinations(train, 2):
        _require_no_overlap(other, "is named twice: each recording counts once", one)
    twice = "is held out twice: each recording counts once"
    for one, other in itertools.combinations(held_out, 2):
        _require_no_overlap(other, twice, one, opened=False)
    for file in held_out:
        path = strip_window_suffix(Path(file))
        if not path.is_file() or not os.access(path, os.R_OK):
            raise DataError(f"{file} cannot be held out: there is no such file that can be read")
        for learnt in train:
            _require_no_overlap(file, "is learnt from: it cannot be held out", learnt, opened=False)


def _require_no_overlap(
    file: str | Path, reason: str, other: str | Path, opened: bool = True
) -> None:
    """Raise ValueError with `reason` if two files share values; `opened` compares contents."""
    if paths_overlap(Path(file), Path(other), opened):
        paths = {os.path.realpath(strip_window_suffix(Path(one))) for one in (file, other)}
        copied = f", a copy of {other}," if len(paths) > 1 else ""
        raise ValueError(f"{file}{copied} {reason}")
