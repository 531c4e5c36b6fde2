"""A study loses nothing and doubles nothing, whatever ends it and whoever computes it."""

from __future__ import annotations

import errno
import itertools
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest

from engine.batch.batch import Batch, BatchResult
from engine.batch.interpreted_batch import run_interpreted_batch
from language.text.diagnostic import SpecError
from sweep.analysis.summary import summary_of
from sweep.definition.measure import StoreColumn
from sweep.definition.study import Presentation as Shown, Study
from sweep.execution.executor import BlockResult, SerialExecutor
from sweep.execution.process_executor import MAX_DEATHS, ProcessExecutor
from sweep.execution.study_run import fill_store, run_study
from sweep.store.manifest import Manifest, manifest_of
from sweep.store.row import Block, Row
from sweep.store.store import Store, lock_folder, open_store, read_store
from tests.sweep.example_studies import (
    QUICK_EXECUTOR,
    ReversedExecutor,
    make_study,
    quick_results,
    store_rows,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and fork of POSIX")


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "blocks").iterdir())}


def test_results_do_not_depend_on_block_size_or_order(tmp_path: Path) -> None:
    made = make_study()
    whole = run_study(made, tmp_path / "whole", QUICK_EXECUTOR)
    assert (whole.reused, whole.computed) == (0, 60)
    rows = store_rows(whole.store)
    assert [row["number"] for row in rows] == list(range(60))
    for name, size in (("sevens", 7), ("one", 60)):
        parts = run_study(made, tmp_path / name, ReversedExecutor(), block_size=size)
        assert store_rows(parts.store) == rows
    backwards = run_study(made, tmp_path / "backwards", ReversedExecutor())
    assert bytes_of(backwards.store.folder) == bytes_of(whole.store.folder)


def test_a_finished_study_is_not_computed_again(tmp_path: Path) -> None:
    made = make_study()
    run_study(made, tmp_path, QUICK_EXECUTOR)
    before = bytes_of(tmp_path)
    again = run_study(made, tmp_path, SerialExecutor(lambda batch: pytest.fail("computed again")))
    assert (again.reused, again.computed) == (60, 0)
    assert bytes_of(tmp_path) == before


def test_another_state_of_the_study_is_refused_and_what_changed_is_named(tmp_path: Path) -> None:
    run_study(make_study(), tmp_path, QUICK_EXECUTOR)
    with pytest.raises(SpecError, match="sampling changed"):
        run_study(make_study("grid", ("seed: 3", "seed: 4")), tmp_path, QUICK_EXECUTOR)
    shown = make_study("grid", ("{histogram: t_1, by: d}", "{histogram: peak}"))
    assert run_study(shown, tmp_path, QUICK_EXECUTOR).computed == 0
    assert read_store(tmp_path).manifest.presentation.plots["spread"]["of"] == ["peak"]


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(SpecError, match="something else"):
        run_study(make_study(), tmp_path, QUICK_EXECUTOR)
    assert {path.name for path in tmp_path.iterdir()} <= {"thesis.tex", ".lock"}
    with pytest.raises(SpecError, match="no results"):
        read_store(tmp_path)


def test_a_damaged_block_is_computed_again(tmp_path: Path) -> None:
    made = make_study()
    run_study(made, tmp_path, QUICK_EXECUTOR, block_size=10)
    before = bytes_of(tmp_path)
    names = list(before)
    (tmp_path / "blocks" / names[1]).write_bytes(before[names[1]][:-20])
    (tmp_path / "blocks" / names[3]).write_bytes(b"")
    (tmp_path / "blocks" / names[4]).rename(tmp_path / "blocks" / names[2])
    again = run_study(made, tmp_path, QUICK_EXECUTOR)
    assert again.computed == 40
    assert bytes_of(tmp_path) == before


def test_two_processes_do_not_write_into_one_folder(tmp_path: Path) -> None:
    made = make_study()
    with lock_folder(tmp_path), pytest.raises(SpecError, match="another process"):
        run_study(made, tmp_path, QUICK_EXECUTOR)


def slow(batch: Batch) -> BatchResult:
    time.sleep(0.01)
    return quick_results(batch)


def test_killed_at_random_instants_and_gone_on_with_it_equals_the_undisturbed(
    tmp_path: Path,
) -> None:
    """kill -9 of the process that computes and writes; tests/validation/evidence/studies.py does it
    20 times through the command line.
    """
    made = make_study()
    run_study(made, tmp_path / "undisturbed", QUICK_EXECUTOR, block_size=2)
    random = np.random.default_rng(4)
    done = [0]
    for _ in range(3):
        child = os.fork()
        if child == 0:
            run_study(made, tmp_path / "killed", SerialExecutor(slow), block_size=2)
            os._exit(0)
        while len(list((tmp_path / "killed").glob("blocks/0*.parquet"))) <= done[-1]:
            time.sleep(0.001)
        time.sleep(float(random.uniform(0.0, 0.05)))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        done.append(len(read_store(tmp_path / "killed").paths()))
    assert done == sorted(set(done))
    assert done[-1] < 30, done
    last = run_study(made, tmp_path / "killed", QUICK_EXECUTOR)
    assert last.reused == 2 * done[-1]
    assert bytes_of(tmp_path / "killed") == bytes_of(tmp_path / "undisturbed")


def test_a_full_disk_ends_the_run_and_what_is_finished_is_kept(tmp_path: Path) -> None:
    """Files may have no more bytes: the write itself fails in the middle, as on a full disk."""
    made = make_study()
    run_study(made, tmp_path / "undisturbed", QUICK_EXECUTOR, block_size=10)
    store = open_store(tmp_path / "full", manifest_of(made, 10))
    size = min(len(data) for data in bytes_of(tmp_path / "undisturbed").values())

    def filling(study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        for number, finished in enumerate(QUICK_EXECUTOR(study, blocks)):
            if number == 3:
                resource.setrlimit(resource.RLIMIT_FSIZE, (size // 2, limits[1]))
            yield finished

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    old = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with pytest.raises(OSError):
            run_study(made, tmp_path / "full", filling)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, old)
    assert len(store.paths()) == 3
    assert [path.name for path in store.folder.rglob("*.part")] == []
    assert run_study(made, tmp_path / "full", QUICK_EXECUTOR).reused == 30
    assert bytes_of(tmp_path / "full") == bytes_of(tmp_path / "undisturbed")


def test_on_a_small_disk_a_study_goes_on_when_there_is_room(tmp_path: Path) -> None:
    """A tmpfs of 64 kB; where none may be mounted, the limit above has to do."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        return
    try:
        made = make_study()
        run_study(made, tmp_path / "undisturbed", QUICK_EXECUTOR, block_size=2)
        with pytest.raises(OSError) as raised:
            run_study(made, disk / "out", QUICK_EXECUTOR, block_size=2)
        assert raised.value.errno == errno.ENOSPC
        there = read_store(disk / "out").paths()
        assert 0 < len(there) < 30
        assert list(disk.rglob("*.part")) == []
        subprocess.run(["mount", "-o", "remount,size=4m", str(disk)], check=True)
        assert run_study(made, disk / "out", QUICK_EXECUTOR).reused == 2 * len(there)
        assert bytes_of(disk / "out") == bytes_of(tmp_path / "undisturbed")
    finally:
        subprocess.run(["umount", str(disk)], check=True)


WORKER = """
import os, sys
import modewright
from tests.sweep.example_studies import quick_results
from sweep.execution.worker import serve_blocks

def run(batch):
    mark = sys.argv[1]
    if batch.count == 12:
        os.kill(os.getpid(), 9)
    if not os.path.exists(mark):
        open(mark, "w").close()
        os.kill(os.getpid(), 9)
    return quick_results(batch)

serve_blocks(run)
"""


@pytest.mark.long
def test_a_dead_worker_is_replaced_and_what_ends_every_worker_is_left_out(tmp_path: Path) -> None:
    """The first block that is computed kills its worker once, the block of 12 variants always."""
    made = make_study()
    command = [sys.executable, "-c", WORKER, str(tmp_path / "mark")]
    run_study(made, tmp_path / "undisturbed", QUICK_EXECUTOR, block_size=16)
    found = run_study(made, tmp_path / "workers", ProcessExecutor(2, command), block_size=16)
    assert (tmp_path / "mark").exists()
    assert [block.start for block, _ in found.lost_blocks] == [48]
    assert f"{MAX_DEATHS} worker processes" in found.lost_blocks[0][1]
    assert found.computed == 48
    again = run_study(made, tmp_path / "workers", QUICK_EXECUTOR)
    assert (again.reused, again.computed) == (48, 12)
    assert bytes_of(tmp_path / "workers") == bytes_of(tmp_path / "undisturbed")


def test_real_workers_give_the_bits_of_this_process(tmp_path: Path) -> None:
    from modewright.api.studies import WORKER_COMMAND as COMMAND

    made = make_study("alone")
    alone = run_study(made, tmp_path / "alone", SerialExecutor(run_interpreted_batch), block_size=2)
    run_study(made, tmp_path / "worker", ProcessExecutor(1, COMMAND), block_size=2)
    assert bytes_of(tmp_path / "worker") == bytes_of(tmp_path / "alone")
    rows = store_rows(alone.store)
    assert [row["status"] for row in rows] == ["done"] * 5
    assert len({json.dumps(row["final"]) for row in rows}) == 5


def test_what_cannot_be_simulated_is_a_value_of_its_row(tmp_path: Path) -> None:
    found = run_study(make_study("failing_ways"), tmp_path, SerialExecutor(run_interpreted_batch))
    rows = store_rows(Store(tmp_path, found.store.manifest))
    told = {row["k_now"]: (row["status"], row["message"]) for row in rows}
    assert told[0.0] == ("done", "")
    assert told[1.0][0] == "stopped" and "fire for ever" in str(told[1.0][1])
    assert told[2.0][0] == "stopped" and "events in one step" in str(told[2.0][1])
    assert told[3.0][0] == "stopped" and "state `x` is" in str(told[3.0][1])
    assert told[9.0] == ("refused", "`plant.k` = 9 is outside its range [0, 5]")
    faulty = {row["k_now"]: row for row in rows}[4.0]
    assert (faulty["status"], faulty["message"]) == ("fault", "a fault bit is set: `eye: range_u`")
    assert all(row["final"] is None for row in rows if row["status"] in ("stopped", "refused"))


def test_a_store_holds_any_work_that_comes_in_blocks(tmp_path: Path) -> None:
    """As the proof of the diagnosis does: rows of its own, texts too."""
    of = Manifest(
        "proof", "0" * 64, {}, 5, 2, (), {}, (StoreColumn("named", "text", "1"),), Shown()
    )

    def compute(blocks: Iterable[Block]) -> Iterator[BlockResult]:
        for block in blocks:
            numbers = range(block.start, block.stop)
            rows = [
                Row(n, "", "", n, 0, 0, {}, "done", "", {"named": f"case {n}"}) for n in numbers
            ]
            yield BlockResult(block, rows)

    fill_store(of, tmp_path, lambda blocks: itertools.islice(compute(blocks), 1))
    found = fill_store(of, tmp_path, compute)
    assert (found.reused, found.computed) == (2, 3)
    assert [row["named"] for row in store_rows(found.store)] == [f"case {n}" for n in range(5)]
    assert summary_of(found.store).counts == {"done": 5}
