"""Garbage is looked for rarely while something is computed, and as before afterwards."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from modewright.runtime.gc_threshold import GENERATION_0_THRESHOLD, infrequent_gc


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    before = gc.get_threshold()
    yield
    gc.set_threshold(*before)


@pytest.mark.parametrize(
    ("before", "within"),
    [
        (700, GENERATION_0_THRESHOLD),
        (2 * GENERATION_0_THRESHOLD, 2 * GENERATION_0_THRESHOLD),
        (0, 0),
    ],
)
def test_it_is_looked_for_as_rarely_as_can_be(before: int, within: int) -> None:
    gc.set_threshold(before, 11, 12)
    with infrequent_gc():
        assert gc.get_threshold() == (within, 11, 12)
    assert gc.get_threshold() == (before, 11, 12)


def test_an_error_leaves_it_as_it_was() -> None:
    gc.set_threshold(700, 10, 10)
    with pytest.raises(ValueError, match="this"), infrequent_gc():
        raise ValueError("this")
    assert gc.get_threshold() == (700, 10, 10)
