"""Study run: the blocks of a study that are not there yet, computed and kept one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sweep.block import Block
from sweep.executor import Executor, Finished
from sweep.manifest import Manifest, manifest_of
from sweep.store import Store, locked, open_store, require_own
from sweep.study import Study

Progress = Callable[[int, int, int], None]
"""Told how many variants are done, how many of these were there before, and how many in all."""
Warn = Callable[[str], None]
"""Told in one line what is not as it should be, and does not end the run."""


@dataclass(frozen=True)
class StudyRun:
    """The store after a run; `lost` are blocks that could not be computed, with the reason."""

    store: Store
    before: int
    computed: int
    lost: tuple[tuple[Block, str], ...] = ()


def run_study(
    study: Study,
    folder: Path,
    executor: Executor,
    block: int | None = None,
    progress: Progress | None = None,
    warn: Warn | None = None,
) -> StudyRun:
    """Run a prepared study into a folder, or go on where another run of it ended.

    Raises SpecError where the folder is of another study, OSError where it cannot be written.
    """
    return fill(manifest_of(study, block), folder, partial(executor, study), progress, warn)


def fill(
    manifest: Manifest,
    folder: Path,
    compute: Callable[[Iterable[Block]], Iterator[Finished]],
    progress: Progress | None = None,
    warn: Warn | None = None,
) -> StudyRun:
    """Fill a store with blocks of any kind of work; what is there is not computed again.

    What is damaged is. Raises SpecError where the folder is of something else, OSError where it
    cannot be written.
    """
    require_own(folder, manifest)  # before anything is made there, a lock too
    with locked(folder):
        store = open_store(folder, manifest)
        total = manifest.count
        there = _whole(store, warn or _silent)
        missing = [each for each in store.manifest.blocks if each.start not in there]
        before = total - sum(each.stop - each.start for each in missing)
        done, lost = before, []
        tell = progress or _silent
        tell(done, before, total)
        finished = compute(missing)
        try:
            for part in finished:
                if part.lost:
                    lost.append((part.block, part.lost))
                    continue
                if part.file:
                    store.keep(part.block, part.file)
                else:
                    store.write(part.block, part.rows)
                done += part.block.stop - part.block.start
                tell(done, before, total)
        finally:
            close = getattr(finished, "close", None)
            if close:
                close()
        return StudyRun(store, before, done - before, tuple(lost))


def _whole(store: Store, warn: Warn) -> set[int]:
    """Return the starts of the blocks that are there; tell which are damaged."""
    found = store.found()
    for path in found.damaged:
        warn(f"{path} is damaged: its variants are computed again")
    return {block.start for block in found.whole}


def _silent(*told: object) -> None:
    """Tell nobody."""
