"""BLAS threads: restrict linear algebra to one thread."""

from __future__ import annotations

from contextlib import ContextDecorator

from threadpoolctl import threadpool_limits


class SingleThreadedBlas(ContextDecorator):
    """Context manager and decorator that restricts BLAS to one thread.

    The matrices of a diagnosis are small; with more threads it takes twice the processor time and
    is not faster.
    """

    def __enter__(self) -> None:
        """Restrict BLAS to one thread."""
        self._limits = threadpool_limits(1)

    def __exit__(self, *_: object) -> None:
        """Restore the number of threads."""
        self._limits.restore_original_limits()
