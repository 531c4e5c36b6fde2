"""Executor: the protocol for computing the blocks of a study, and a serial implementation."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from engine.batch.batch import BatchRunner
from sweep.definition.study import Study
from sweep.execution.block_computation import compute_rows
from sweep.store.row import Block, Row


@dataclass(frozen=True)
class BlockResult:
    """The rows of a block in the order of their numbers, or the `file` that another process
    encoded.

    `lost_reason` is set if there is neither.
    """

    block: Block
    rows: Sequence[Row] = ()
    lost_reason: str = ""
    file: bytes = b""


class Executor(Protocol):
    """Computation of blocks.

    The results depend neither on the executor nor on the order of blocks.
    """

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield the blocks in the order of completion.

        Closing the iterator ends the computation.
        """


@dataclass(frozen=True)
class SerialExecutor:
    """Executor that computes the blocks one after another in this process."""

    run: BatchRunner

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield the blocks in their order."""
        for block in blocks:
            yield BlockResult(block, compute_rows(study, block, self.run))
