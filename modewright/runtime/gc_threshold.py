"""GC threshold: run the collector less often, because expression trees have no cycles."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

GENERATION_0_THRESHOLD = 1_000_000
"""Number of new objects after which the collector runs."""


def raise_gc_threshold() -> None:
    """Raise the threshold of generation 0 to GENERATION_0_THRESHOLD, unless it is larger.

    Does nothing if the collector is disabled by a threshold of 0.
    """
    young, *older = gc.get_threshold()
    if young:
        gc.set_threshold(max(young, GENERATION_0_THRESHOLD), *older)


@contextmanager
def infrequent_gc() -> Iterator[None]:
    """Raise the threshold as `raise_gc_threshold` in the context and restore it at the end.

    The collector took 4 % of a diagnosis.
    """
    before = gc.get_threshold()
    raise_gc_threshold()
    try:
        yield
    finally:
        gc.set_threshold(*before)
