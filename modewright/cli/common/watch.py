"""Watching: when specs below some folders change, by the times and sizes of their files."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

POLL_INTERVAL = 0.2
"""Seconds between two looks: an edit is seen at once, and looking costs nothing."""
FileStamps = dict[Path, tuple[int, int]]


def wait_for_poll() -> None:
    """Wait until the next look."""
    time.sleep(POLL_INTERVAL)


def watch_changes(
    folders: Collection[Path], wait: Callable[[], None] | None = None
) -> Iterator[list[Path]]:
    """Yield the files that were written, made or removed, as often as there are some."""
    before = read_stamps(folders)
    while True:
        (wait or wait_for_poll)()
        now = read_stamps(folders)
        changed = sorted(path for path in before | now if before.get(path) != now.get(path))
        before = now
        if changed:
            yield changed


def read_stamps(folders: Collection[Path]) -> FileStamps:
    """Return when each spec below some folders was written [ns], and its size."""
    found: FileStamps = {}
    for folder in folders:
        for path in folder.rglob("*.yaml"):
            try:
                status = path.stat()
            except OSError:
                continue  # removed just now
            found[path] = status.st_mtime_ns, status.st_size
    return found


def spec_folders(names: Collection[str]) -> list[Path]:
    """Return the folders of specs: `spec/` of the project, and those of files that are named."""
    named = {Path(name).parent for name in names if name.endswith(".yaml")}
    inside = [folder for folder in sorted(named) if Path("spec") not in (folder, *folder.parents)]
    return [Path("spec"), *inside]
