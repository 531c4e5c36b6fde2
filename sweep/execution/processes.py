"""Processes: an executor of several processes on this machine.

A worker that dies is replaced and its block given to another one; a block that has ended three
workers is left out, and said to be.
"""

from __future__ import annotations

import contextlib
import queue
import subprocess
import threading
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from sweep.definition.study import Study
from sweep.execution.executor import BlockResult
from sweep.execution.worker import receive_message, send_message
from sweep.store.row import Block

MAX_DEATHS = 3
"""Workers that may die of one block."""


class WorkerError(Exception):
    """A defect of our code in a worker: the message is its traceback."""


@dataclass(frozen=True)
class ProcessExecutor:
    """`count` processes that are started by `command`, see sweep/execution/worker.py."""

    count: int
    command: Sequence[str]

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield each block as it is finished; closing the iterator ends all processes."""
        pool = _Pool(study, self.command, deque(blocks))
        try:
            yield from pool.results(self.count)
        finally:
            pool.stop()


@dataclass
class _Pool:
    """What the threads share that look after one process each."""

    study: Study
    command: Sequence[str]
    waiting: deque[Block]
    answers: queue.Queue[BlockResult | BaseException | None] = field(default_factory=queue.Queue)
    running: list[subprocess.Popen[bytes]] = field(default_factory=list)
    deaths: dict[Block, int] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    is_stopped: bool = False

    def results(self, count: int) -> Iterator[BlockResult]:
        count = max(1, min(count, len(self.waiting)))
        for _ in range(count):
            threading.Thread(target=self._serve_process, daemon=True).start()
        ended = 0
        while ended < count:
            answer = self.answers.get()
            if isinstance(answer, BaseException):
                raise answer
            if answer is None:
                ended += 1
            else:
                yield answer

    def stop(self) -> None:
        """End all processes now."""
        with self.lock:
            self.is_stopped = True
            running = list(self.running)
        for process in running:
            process.kill()
        for process in running:
            process.wait()

    def _serve_process(self) -> None:
        """Give blocks to one process after another of our own until there are none."""
        process: subprocess.Popen[bytes] | None = None
        try:
            while True:
                block = self._next_block()
                if block is None:
                    break
                try:
                    process = process or self._start_process()
                    self._compute_block(process, block)
                except (EOFError, OSError):
                    if process is not None:
                        _close_process(process)
                    process = None
                    self._retry_block(block)
        except BaseException as error:
            self.answers.put(error)
        finally:
            if process is not None:
                _close_process(process)
            self.answers.put(None)

    def _next_block(self) -> Block | None:
        with self.lock:
            return self.waiting.popleft() if self.waiting and not self.is_stopped else None

    def _start_process(self) -> subprocess.Popen[bytes]:
        with self.lock:
            if self.is_stopped:
                raise EOFError
            pipe = subprocess.PIPE
            process = subprocess.Popen(
                self.command, stdin=pipe, stdout=pipe, start_new_session=True
            )
            self.running.append(process)
        assert process.stdin
        send_message(process.stdin, self.study)
        return process

    def _compute_block(self, process: subprocess.Popen[bytes], block: Block) -> None:
        assert process.stdin and process.stdout
        send_message(process.stdin, block)
        answer = receive_message(process.stdout)
        if isinstance(answer, str):
            raise WorkerError(answer)
        self.answers.put(BlockResult(block, file=answer))

    def _retry_block(self, block: Block) -> None:
        """Give the block to another worker, at most three times."""
        with self.lock:
            if self.is_stopped:
                return
            self.deaths[block] = self.deaths.get(block, 0) + 1
            if self.deaths[block] < MAX_DEATHS:
                self.waiting.append(block)
                return
        reason = f"{MAX_DEATHS} worker processes died while they computed it"
        self.answers.put(BlockResult(block, lost_reason=reason))


def _close_process(process: subprocess.Popen[bytes]) -> None:
    """Close the input of a process, which ends it."""
    with contextlib.suppress(OSError):
        if process.stdin:
            process.stdin.close()
    process.kill()
    process.wait()
    if process.stdout:
        process.stdout.close()
