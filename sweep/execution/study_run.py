"""Study run: compute the missing blocks of a study and store each one when it is finished."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sweep.definition.study import Study
from sweep.execution.executor import BlockResult, Executor
from sweep.store.manifest import Manifest, manifest_of
from sweep.store.row import Block
from sweep.store.store import Store, lock_folder, open_store, require_same_study

Progress = Callable[[int, int, int], None]
"""Called with the number of finished variants, of those finished before, and of all variants."""
Warn = Callable[[str], None]
"""Called with a one-line warning that does not end the run."""


@dataclass(frozen=True)
class StudyRun:
    """The store after a run, with the number of reused and computed variants.

    `lost_blocks` are the blocks that could not be computed, with reasons.
    """

    store: Store
    reused: int
    computed: int
    lost_blocks: tuple[tuple[Block, str], ...] = ()


def run_study(
    study: Study,
    folder: Path,
    executor: Executor,
    block_size: int | None = None,
    progress: Progress | None = None,
    warn: Warn | None = None,
) -> StudyRun:
    """Run a prepared study into a folder, or continue an earlier run.

    `block_size` is that of a new store; None chooses one. A damaged block is computed again and
    told to `warn`. Raises SpecError if the folder belongs to another study or process or contains
    something else, OSError if it cannot be written, MissingToolError without pyarrow.
    """
    return fill_store(
        manifest_of(study, block_size), folder, partial(executor, study), progress, warn
    )


def fill_store(
    manifest: Manifest,
    folder: Path,
    compute: Callable[[Iterable[Block]], Iterator[BlockResult]],
    progress: Progress | None = None,
    warn: Warn | None = None,
) -> StudyRun:
    """Compute the missing and the damaged blocks of a store with `compute`, and store them.

    Each block is stored when it is finished. The iterator of `compute` is closed at the end, also
    after an error. `progress` is called at the start and after each block. Raises SpecError if the
    folder contains something else or another process writes into it, OSError if it cannot be
    written.
    """
    require_same_study(folder, manifest)  # before any file is created, also the lock
    with lock_folder(folder):
        store = open_store(folder, manifest)
        total = manifest.count
        complete = _complete_starts(store, warn or _ignore)
        missing = [each for each in store.manifest.blocks if each.start not in complete]
        before = total - sum(each.stop - each.start for each in missing)
        done, lost = before, []
        report = progress or _ignore
        report(done, before, total)
        finished = compute(missing)
        try:
            for part in finished:
                if part.lost_reason:
                    lost.append((part.block, part.lost_reason))
                    continue
                if part.file:
                    store.write_block_file(part.block, part.file)
                else:
                    store.write_rows(part.block, part.rows)
                done += part.block.stop - part.block.start
                report(done, before, total)
        finally:
            close = getattr(finished, "close", None)
            if close:
                close()
        return StudyRun(store, before, done - before, tuple(lost))


def _complete_starts(store: Store, warn: Warn) -> set[int]:
    """Return the starts of the complete blocks; warn of damaged ones."""
    found = store.scan()
    for path in found.damaged:
        warn(f"{path} is damaged: its variants are computed again")
    return {block.start for block in found.complete}


def _ignore(*arguments: object) -> None:
    """Ignore a report."""
