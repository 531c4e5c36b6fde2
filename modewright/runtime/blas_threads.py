"""Threads: linear algebra on one of them, where matrices are small and come by the thousand."""

from __future__ import annotations

from contextlib import ContextDecorator

from threadpoolctl import threadpool_limits


class SingleThreadedBlas(ContextDecorator):
    """While it is entered, or a function that it decorates runs, BLAS takes one thread.

    More would wait for each other most of the time: a diagnosis takes half of the processor time
    with one, and no longer.
    """

    def __enter__(self) -> None:
        """Take one thread."""
        self._limits = threadpool_limits(1)

    def __exit__(self, *_: object) -> None:
        """Take as many as before."""
        self._limits.restore_original_limits()
