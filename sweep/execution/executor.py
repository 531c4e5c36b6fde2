"""Executor: what computes the blocks of a study - the protocol, and one in this process."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from engine.batch.batch import BatchRunner
from sweep.definition.study import Study
from sweep.execution.block import compute_rows
from sweep.store.row import Block, Row


@dataclass(frozen=True)
class BlockResult:
    """The rows of a block in the order of their numbers, or its `file` as another process made it.

    `lost` says why there is neither.
    """

    block: Block
    rows: Sequence[Row] = ()
    lost_reason: str = ""
    file: bytes = b""


class Executor(Protocol):
    """Computes blocks; results do not depend on which executor does, nor on their order."""

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield each block as it is finished; closing the iterator ends the work."""


@dataclass(frozen=True)
class SerialExecutor:
    """One block after another in this process."""

    run: BatchRunner

    def __call__(self, study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Yield each block as it is finished."""
        for block in blocks:
            yield BlockResult(block, compute_rows(study, block, self.run))
