"""Recording names: names of recordings that are unique within a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path


def distinguish_file_names(paths: Sequence[Path]) -> Mapping[Path, str]:
    """Return a display name for each path: the file name, with parent folders if names repeat.

    All names have the same number of trailing path components, joined with `/`: the smallest number
    that makes all of them different. If two paths are the same absolute path (links are not
    resolved), all names are absolute paths.
    """
    absolute = {path: path.absolute().parts for path in paths}
    names: dict[Path, str] = {}
    for count in range(1, max((len(parts) for parts in absolute.values()), default=0) + 1):
        names = {path: "/".join(parts[-count:]) for path, parts in absolute.items()}
        if len(set(names.values())) == len(names):
            break
    return names


def recording_names(train: Sequence[Path], held_out: Sequence[Path]) -> Mapping[Path, str]:
    """Return a unique display name for each training and held-out recording.

    Each group is named by itself. If a held-out recording has the name of a training recording, the
    held-out names get as many folders as make all names of both groups different.
    """
    learnt, own = distinguish_file_names(train), distinguish_file_names(held_out)
    if set(learnt.values()) & set(own.values()):
        together = distinguish_file_names([*train, *held_out])
        own = {path: together[path] for path in held_out}
    return {**learnt, **own}
