"""Blocks under way: a client without processes, that answers in an order of its own."""

from __future__ import annotations

import dataclasses
import queue
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from typing import Any

import pytest
from distributed import KilledWorker
from distributed.scheduler import WorkerState
from hypothesis import HealthCheck, given, settings, strategies as st

from sweep.execution.dask_error import ClusterError
from sweep.execution.dask_executor import BLOCKS_PER_THREAD, DaskExecutor
from sweep.execution.dask_worker import Answer
from sweep.execution.study_run import run_study
from sweep.store.row import Block
from tests.sweep.example_studies import QUICK_EXECUTOR, make_study, store_rows
from tests.sweep.failing_workers import answer_quickly


class Desk:
    """Takes what a client is given, answers it in any order, and counts."""

    def __init__(self, order: Callable[[int], int], threads: int = 3, deadly: int = -1) -> None:
        self.order, self.threads, self.deadly = order, threads, deadly
        self.most = 0
        self.waiting: list[tuple[Reply, Callable[[], Any]]] = []
        self.status = "running"

    def nthreads(self, callback_timeout: float) -> dict[str, int]:
        return {"worker": self.threads}

    def submit(self, function: Any, *arguments: Any, pure: bool) -> Reply:
        reply = Reply(self)
        if function is bytes:
            reply.set_result(arguments[0])
            return reply
        wanted, held, start, stop = arguments
        self.waiting.append(
            (reply, lambda: self._answer(function, wanted, held.result(), start, stop))
        )
        self.most = max(self.most, len(self.waiting))
        return reply

    def cancel(self, replies: Any, force: bool) -> None:
        self.waiting.clear()

    def _answer(self, task: Any, wanted: Mapping[str, str], held: bytes, *ends: int) -> Answer:
        if ends[0] == self.deadly:
            raise KilledWorker("block", _worker(), 2)
        found: Answer = task(wanted, held, *ends)
        return found

    def turn(self) -> None:
        """Answer one of those that wait."""
        reply, work = self.waiting.pop(self.order(len(self.waiting)))
        try:
            reply.set_result(work())
        except KilledWorker as error:
            reply.set_exception(error)


class Reply(Future[Any]):
    """A future whose desk answers when somebody waits."""

    def __init__(self, desk: Desk) -> None:
        super().__init__()
        self.desk = desk
        self.key = f"reply-{id(self)}"


def _worker() -> WorkerState:
    return WorkerState(
        address="tcp://127.0.0.1:1", status="running", pid=1, name="w", nthreads=1,
        memory_limit=1, local_directory="", nanny="", server_id="w", services={}, versions={},
        extra={}, scheduler=None,
    )  # fmt: skip


class Turning(queue.SimpleQueue):  # type: ignore[type-arg]
    """A queue that lets its desk answer when it is empty."""

    desk: Desk

    def get(self, block: bool = True, timeout: float | None = None) -> Any:
        if self.empty() and self.desk.waiting:
            self.desk.turn()
        return super().get(block=False)


def cluster_of(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> DaskExecutor:
    kind = type("Turned", (Turning,), {"desk": desk})
    monkeypatch.setattr("sweep.execution.dask_executor.SimpleQueue", kind)
    return DaskExecutor(desk, answer_quickly)


@pytest.mark.long
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(size=st.integers(1, 60), threads=st.integers(1, 9), seed=st.randoms(use_true_random=False))
def test_rows_depend_on_no_worker_no_block_size_and_no_order(
    tmp_path_factory: pytest.TempPathFactory, size: int, threads: int, seed: Any
) -> None:
    made, folder = make_study(), tmp_path_factory.mktemp("any")
    desk = Desk(lambda count: seed.randrange(count), threads)
    with pytest.MonkeyPatch.context() as patch:
        found = run_study(made, folder / "there", cluster_of(desk, patch), block_size=size)
    assert store_rows(found.store) == store_rows(
        run_study(made, folder / "here", QUICK_EXECUTOR).store
    )
    assert desk.most <= BLOCKS_PER_THREAD * threads


def test_only_so_many_blocks_are_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = 0

    def blocks() -> Iterator[Block]:
        nonlocal taken
        for start in range(60):
            taken = start + 1
            yield Block(start, start + 1)

    desk = Desk(lambda count: 0, threads=2)
    for done, finished in enumerate(cluster_of(desk, monkeypatch)(make_study(), blocks()), start=1):
        assert finished.file
        assert taken <= done + BLOCKS_PER_THREAD * desk.threads
    assert taken == 60


def test_a_block_is_to_blame_only_where_it_is_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(lambda count: 0, deadly=2)
    blocks = [Block(k, k + 1) for k in range(5)]
    found = list(cluster_of(desk, monkeypatch)(make_study(), blocks))
    assert [each.block.start for each in found] == [0, 1, 3, 4, 2]
    assert [each.lost_reason for each in found if each.lost_reason] == [
        "3 workers died while it was computed alone"
    ]


def test_a_cluster_whose_workers_are_all_gone_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweep.execution.dask_executor.POLL_INTERVAL", 0.0)
    desk = Desk(lambda count: 0, threads=0)
    with pytest.raises(ClusterError, match="no worker any more for 0 s"):
        list(
            dataclasses.replace(cluster_of(desk, monkeypatch), timeout=0.0)(
                make_study(), [Block(0, 1)]
            )
        )
