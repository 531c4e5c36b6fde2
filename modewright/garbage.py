"""Garbage: it is looked for rarely, for trees of expressions have no circles."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

YOUNG_OBJECTS = 1_000_000
"""New objects after which garbage is looked for."""


def look_rarely() -> None:
    """Let garbage be looked for rarely from now on; not at all where it was not."""
    young, *older = gc.get_threshold()
    if young:
        gc.set_threshold(max(young, YOUNG_OBJECTS), *older)


@contextmanager
def rarely_looked() -> Iterator[None]:
    """Let garbage be looked for rarely while it lasts: that took 4 % of a diagnosis."""
    before = gc.get_threshold()
    look_rarely()
    try:
        yield
    finally:
        gc.set_threshold(*before)
