"""Recording names: names of recordings that are unique within a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from language.text.sanitise import escape_invisible


def distinguish_file_names(paths: Sequence[Path]) -> Mapping[Path, str]:
    """Return the file name of each path, with as many parent folders as make names unique.

    Names are absolute paths if two paths are the same. They have one line (`escape_invisible`).
    """
    absolute = {path: path.absolute().parts for path in paths}
    names: dict[Path, str] = {}
    for count in range(1, max((len(parts) for parts in absolute.values()), default=0) + 1):
        names = {
            path: escape_invisible("/".join(parts[-count:])) for path, parts in absolute.items()
        }
        if len(set(names.values())) == len(names):
            break
    return names


def recording_names(train: Sequence[Path], held_out: Sequence[Path]) -> Mapping[Path, str]:
    """Return a unique display name for each training and held-out recording.

    Only the held-out names get folders if the groups share a name.
    """
    learnt, own = distinguish_file_names(train), distinguish_file_names(held_out)
    if set(learnt.values()) & set(own.values()):
        together = distinguish_file_names([*train, *held_out])
        own = {path: together[path] for path in held_out}
    return {**learnt, **own}
