"""Cluster: an executor on the workers of a Dask cluster, here or elsewhere.

A worker that dies is survived: its blocks are given to others. A block that several have died of is
computed again at the end, alone; where that ends workers too, it is left out, and said to be.
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

from sweep.block import Block
from sweep.cluster_error import ClusterError
from sweep.cluster_worker import Answer, packed
from sweep.executor import Finished
from sweep.fingerprint import fingerprint
from sweep.processes import WorkerError
from sweep.study import Study

Task = Callable[[Mapping[str, str], bytes, int, int], Answer]
"""What a worker does: with the client's fingerprint, a packed study, the ends of a block.

It is sent by its name, so workers have it from their own installation.
"""

HOLD: Callable[[bytes], bytes] = bytes
"""What a worker does with the study, and then has it: of Python's own, so that workers with other
code can do it, too, and refuse the rest.
"""
IN_FLIGHT = 2
"""Blocks that each thread of a worker has at most: one that is computed, one to go on with."""
MOST_GIVEN = 10
"""How often workers may die that were given the study: then it is the study that they die of."""
LOOK = 5.0
"""Time [s] between two looks at how many workers there are."""
PATIENCE = 60.0
"""Time [s] without any worker, or an answer of the scheduler, after which a cluster is given up."""


@dataclass(frozen=True)
class Cluster:
    """The workers of a client; each does `task`."""

    client: Client
    task: Task
    patience: float = PATIENCE

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[Finished]:
        """Yield each block as it is finished; closing the iterator ends the work."""
        flight = _Flight(self, packed(study))
        try:
            flight.hold()
            suspects = []
            for finished in flight.finished(blocks):
                if finished.lost:
                    suspects.append(finished.block)
                else:
                    yield finished
            for block in suspects:
                yield from flight.finished([block])
        finally:
            flight.end()


@dataclass
class _Flight:
    """What is under way: the `study` that workers hold, and the blocks that they have.

    `former` are the keys of what was held by workers that died.
    """

    cluster: Cluster
    study: bytes
    held: Any = None
    former: set[str] = field(default_factory=set)
    under_way: dict[Future, Block] = field(default_factory=dict)
    ended: SimpleQueue[Future] = field(default_factory=lambda: SimpleQueue())
    looked: float = float("-inf")
    seen: float = field(default_factory=time.monotonic)
    threads: int = 0

    def finished(self, blocks: Iterable[Block]) -> Iterator[Finished]:
        """Yield blocks as they are finished; those that workers died of are lost."""
        waiting = iter(blocks)
        while True:
            self._look()
            room = max(1, IN_FLIGHT * self.threads) - len(self.under_way)
            for block in itertools.islice(waiting, max(0, room)):
                self._submit(block)
            if not self.under_way:
                return
            try:
                future = self.ended.get(timeout=LOOK)
            except Empty:
                continue
            found = self._result(future)
            if found:
                yield found

    def hold(self) -> None:
        """Give the study to a worker, from which the others have it."""
        if self.held:
            self.former.add(self.held.key)
        self.held = self.cluster.client.submit(HOLD, self.study, pure=False)

    def end(self) -> None:
        """Take back what is under way."""
        client = self.cluster.client
        if client.status == "running":
            client.cancel([*self.under_way, *([self.held] if self.held else [])], force=True)
        self.under_way.clear()

    def _submit(self, block: Block) -> None:
        future = self.cluster.client.submit(
            self.cluster.task, fingerprint(), self.held, block.start, block.stop, pure=False
        )
        self.under_way[future] = block
        future.add_done_callback(self.ended.put)

    def _look(self) -> None:
        """See how many threads there are. Raises ClusterError where nobody is left to compute."""
        client, patience = self.cluster.client, self.cluster.patience
        if client.status in ("closing", "closed"):
            raise ClusterError("the connection to the scheduler is lost")
        if time.monotonic() < self.looked + LOOK:
            return
        try:
            threads = client.nthreads(callback_timeout=patience)
        except TimeoutError:
            raise ClusterError(f"the scheduler does not answer for {patience:g} s") from None
        except OSError as error:
            raise ClusterError(f"the scheduler does not answer any more: {error}") from None
        self.threads = sum(threads.values())
        self.looked = time.monotonic()
        if self.threads:
            self.seen = self.looked
        elif self.looked > self.seen + self.cluster.patience:
            raise ClusterError(f"there is no worker any more for {self.cluster.patience:g} s")

    def _answer(self, future: Future) -> Answer:
        """Return an answer; it may be lost with its worker, and made again, which takes a while."""
        while True:
            try:
                found: Answer = future.result(timeout=self.cluster.patience)
                return found
            except TimeoutError:
                self.looked = float("-inf")
                self._look()

    def _result(self, future: Future) -> Finished | None:
        """Return what became of a block; None where it is under way again, since a worker died of
        another one while it was given the study.
        """
        block = self.under_way.pop(future)
        try:
            answer = self._answer(future)
        except KilledWorker as error:
            if error.task not in (self.held.key, *self.former):
                return Finished(block, lost=_blame(error))
            if len(self.former) + 1 >= MOST_GIVEN:
                return Finished(block, lost=f"{MOST_GIVEN} workers died that were given the study")
            if error.task == self.held.key:
                self.hold()
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
        return Finished(block, file=answer.file)


def _blame(error: KilledWorker) -> str:
    deaths = int(error.allowed_failures) + 1
    return f"{deaths} worker{'s' * (deaths > 1)} died while it was computed alone"
