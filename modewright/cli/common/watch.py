"""Watching: detect changed specs by modification time and size."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

POLL_INTERVAL = 0.2
"""Time [s] between two checks."""
FileStamps = dict[Path, tuple[int, int]]
"""Modification time [ns] and size of each file."""


def wait_for_poll() -> None:
    """Sleep for POLL_INTERVAL."""
    time.sleep(POLL_INTERVAL)


def watch_changes(
    folders: Collection[Path], wait: Callable[[], None] | None = None
) -> Iterator[list[Path]]:
    """Yield the files that were written, created or removed, whenever there are any; never ends."""
    before = read_stamps(folders)
    while True:
        (wait or wait_for_poll)()
        now = read_stamps(folders)
        changed = sorted(path for path in before | now if before.get(path) != now.get(path))
        before = now
        if changed:
            yield changed


def read_stamps(folders: Collection[Path]) -> FileStamps:
    """Return modification time [ns] and size of each YAML file below the folders."""
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
    """Return the folders to watch: `spec/`, and the folders of named files outside it."""
    named = {Path(name).parent for name in names if name.endswith(".yaml")}
    inside = [folder for folder in sorted(named) if Path("spec") not in (folder, *folder.parents)]
    return [Path("spec"), *inside]
