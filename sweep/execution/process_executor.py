"""Process executor: compute blocks in several processes on this machine.

If a worker process dies, another one computes its block. A block during which MAX_DEATHS processes
died is lost and reported.
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
"""Number of workers that may die during one block."""


class WorkerError(Exception):
    """A defect of the code in a worker; the message is its traceback."""


@dataclass(frozen=True)
class ProcessExecutor:
    """Executor with `count` processes that `command` starts; they run sweep/execution/worker.py."""

    count: int
    command: Sequence[str]

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield the blocks in the order of completion; closing the iterator kills all processes."""
        pool = _Pool(study, self.command, deque(blocks))
        try:
            yield from pool.results(self.count)
        finally:
            pool.stop()


@dataclass
class _Pool:
    """The shared state of the threads, each of which serves one process."""

    study: Study
    command: Sequence[str]
    waiting: deque[Block]
    answers: queue.Queue[BlockResult | BaseException | None] = field(default_factory=queue.Queue)
    running: list[subprocess.Popen[bytes]] = field(default_factory=list)
    deaths: dict[Block, int] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    is_stopped: bool = False

    def results(self, count: int) -> Iterator[BlockResult]:
        """Start the threads and yield results in the order of completion.

        Raises WorkerError and other errors of the threads.
        """
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
        """Kill all processes at once."""
        with self.lock:
            self.is_stopped = True
            running = list(self.running)
        for process in running:
            process.kill()
        for process in running:
            process.wait()

    def _serve_process(self) -> None:
        """Send blocks to a process until none is left; start a new process if it dies."""
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
        """Return the next waiting block; None if there is none or the pool is stopped."""
        with self.lock:
            return self.waiting.popleft() if self.waiting and not self.is_stopped else None

    def _start_process(self) -> subprocess.Popen[bytes]:
        """Start a process and send it the study. Raises EOFError if the pool is stopped."""
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
        """Send a block to a process and queue its file. Raises WorkerError for a traceback."""
        assert process.stdin and process.stdout
        send_message(process.stdin, block)
        answer = receive_message(process.stdout)
        if isinstance(answer, str):
            raise WorkerError(answer)
        self.answers.put(BlockResult(block, file=answer))

    def _retry_block(self, block: Block) -> None:
        """Queue a block again, or report it as lost after MAX_DEATHS deaths."""
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
    """Close the input of a process, kill it and wait for its end."""
    with contextlib.suppress(OSError):
        if process.stdin:
            process.stdin.close()
    process.kill()
    process.wait()
    if process.stdout:
        process.stdout.close()
