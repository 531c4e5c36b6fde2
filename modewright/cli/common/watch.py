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
    """Yield the YAML files that were written, created or removed, sorted; never ends.

    The first comparison is with the state at the first `next`. Between two comparisons it calls
    `wait` (default: sleep for POLL_INTERVAL). Without changes nothing is yielded.
    """
    before = read_stamps(folders)
    while True:
        (wait or wait_for_poll)()
        now = read_stamps(folders)
        changed = sorted(path for path in before | now if before.get(path) != now.get(path))
        before = now
        if changed:
            yield changed


def read_stamps(folders: Collection[Path]) -> FileStamps:
    """Return modification time [ns] and size of each file `*.yaml` below the folders, at any depth.

    Files that disappear meanwhile are left out.
    """
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
    """Return the folders to watch: `spec/`, then the folders of the named files outside it, sorted.

    Names that do not end in .yaml are names of specs and add no folder.
    """
    named = {Path(name).parent for name in names if name.endswith(".yaml")}
    inside = [folder for folder in sorted(named) if Path("spec") not in (folder, *folder.parents)]
    return [Path("spec"), *inside]
