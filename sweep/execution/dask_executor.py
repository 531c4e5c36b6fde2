"""Dask executor: compute blocks on the workers of a Dask cluster.

If a worker dies, other workers compute its blocks. A block during which several workers died is
computed again at the end, without other blocks. If workers die again, the block is lost and
reported.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any

from distributed import Client, Future, KilledWorker

from sweep.definition.study import Study
from sweep.execution.dask_error import ClusterError
from sweep.execution.dask_worker import Answer, pack_study
from sweep.execution.executor import BlockResult
from sweep.execution.fingerprint import fingerprint
from sweep.execution.process_executor import WorkerError
from sweep.store.row import Block

BlockTask = Callable[[Mapping[str, str], bytes, int, int], Answer]
"""The function that a worker runs: client fingerprint, packed study, start and stop of a block.

Dask sends it by name, so workers run the function of their own installation.
"""

PLACE_STUDY: Callable[[bytes], bytes] = bytes
"""The function that places the study on a worker.

It is a built-in of Python, so that workers with different code can run it and then refuse blocks.
"""
BLOCKS_PER_THREAD = 2
"""Largest number of blocks for each thread of a worker: one in computation, one waiting."""
MAX_STUDY_DEATHS = 10
"""Worker deaths during the transfer of the study after which the study is considered the cause."""
POLL_INTERVAL = 5.0
"""Time [s] between two checks of the number of workers."""
WORKER_TIMEOUT = 60.0
"""Time [s] without a worker, or without an answer, after which the cluster is given up."""


@dataclass(frozen=True)
class DaskExecutor:
    """Executor on the workers of a client; each worker runs `task`."""

    client: Client
    task: BlockTask
    timeout: float = WORKER_TIMEOUT

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield the blocks in the order of completion; closing the iterator cancels the rest."""
        flight = _DaskRun(self, pack_study(study))
        try:
            flight.place_study()
            suspects = []
            for finished in flight.iterate_results(blocks):
                if finished.lost_reason:
                    suspects.append(finished.block)
                else:
                    yield finished
            for block in suspects:
                yield from flight.iterate_results([block])
        finally:
            flight.cancel()


@dataclass
class _DaskRun:
    """The state of a run: the study on the workers and the pending blocks.

    `former_study_keys` are the Dask keys of copies of the study that dead workers had.
    """

    executor: DaskExecutor
    study: bytes
    study_future: Any = None
    former_study_keys: set[str] = field(default_factory=set)
    pending: dict[Future, Block] = field(default_factory=dict)
    completed: SimpleQueue[Future] = field(default_factory=lambda: SimpleQueue())
    checked_at: float = float("-inf")
    workers_seen_at: float = field(default_factory=time.monotonic)
    threads: int = 0

    def iterate_results(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield the blocks in the order of completion.

        A block during which workers died has a `lost_reason`.
        """
        waiting = iter(blocks)
        while True:
            self._check_workers()
            free = max(1, BLOCKS_PER_THREAD * self.threads) - len(self.pending)
            for block in itertools.islice(waiting, max(0, free)):
                self._submit(block)
            if not self.pending:
                return
            try:
                future = self.completed.get(timeout=POLL_INTERVAL)
            except Empty:
                continue
            found = self._collect_result(future)
            if found:
                yield found

    def place_study(self) -> None:
        """Send the study to a worker, from which the other workers copy it."""
        if self.study_future:
            self.former_study_keys.add(self.study_future.key)
        self.study_future = self.executor.client.submit(PLACE_STUDY, self.study, pure=False)

    def cancel(self) -> None:
        """Cancel the pending blocks and release the study."""
        client = self.executor.client
        if client.status == "running":
            client.cancel(
                [*self.pending, *([self.study_future] if self.study_future else [])], force=True
            )
        self.pending.clear()

    def _submit(self, block: Block) -> None:
        """Send a block to the cluster."""
        future = self.executor.client.submit(
            self.executor.task,
            fingerprint(),
            self.study_future,
            block.start,
            block.stop,
            pure=False,
        )
        self.pending[future] = block
        future.add_done_callback(self.completed.put)

    def _check_workers(self) -> None:
        """Update the number of threads, at most once each POLL_INTERVAL.

        Raises ClusterError if the connection is lost or no worker is present for the timeout.
        """
        client, patience = self.executor.client, self.executor.timeout
        if client.status in ("closing", "closed"):
            raise ClusterError("the connection to the scheduler is lost")
        if time.monotonic() < self.checked_at + POLL_INTERVAL:
            return
        try:
            threads = client.nthreads(callback_timeout=patience)
        except TimeoutError:
            raise ClusterError(f"the scheduler does not answer for {patience:g} s") from None
        except OSError as error:
            raise ClusterError(f"the scheduler does not answer any more: {error}") from None
        self.threads = sum(threads.values())
        self.checked_at = time.monotonic()
        if self.threads:
            self.workers_seen_at = self.checked_at
        elif self.checked_at > self.workers_seen_at + self.executor.timeout:
            raise ClusterError(f"there is no worker any more for {self.executor.timeout:g} s")

    def _wait_for_answer(self, future: Future) -> Answer:
        """Return the answer of a block.

        Checks the workers at each timeout, since Dask may compute the block again.
        """
        while True:
            try:
                found: Answer = future.result(timeout=self.executor.timeout)
                return found
            except TimeoutError:
                self.checked_at = float("-inf")
                self._check_workers()

    def _collect_result(self, future: Future) -> BlockResult | None:
        """Return the result of a block, or None if it was submitted again.

        This happens if a worker died of another block while it received the study. Raises
        ClusterError if a worker refuses the block, and WorkerError for a defect.
        """
        block = self.pending.pop(future)
        try:
            answer = self._wait_for_answer(future)
        except KilledWorker as error:
            if error.task not in (self.study_future.key, *self.former_study_keys):
                return BlockResult(block, lost_reason=_death_message(error))
            if len(self.former_study_keys) + 1 >= MAX_STUDY_DEATHS:
                return BlockResult(
                    block, lost_reason=f"{MAX_STUDY_DEATHS} workers died that were given the study"
                )
            if error.task == self.study_future.key:
                self.place_study()
            self._submit(block)
            return None
        except ImportError as error:
            raise ClusterError(f"a worker cannot import modewright: {error}") from None
        except (CancelledError, OSError):
            raise ClusterError("the scheduler has dropped what it was given: it ended") from None
        if answer.refusal:
            raise ClusterError(f"a worker {answer.refusal}")
        if answer.defect:
            raise WorkerError(answer.defect)
        return BlockResult(block, file=answer.file)


def _death_message(error: KilledWorker) -> str:
    """Return the reason of a lost block, with the number of dead workers."""
    deaths = int(error.allowed_failures) + 1
    return f"{deaths} worker{'s' * (deaths > 1)} died while it was computed alone"
