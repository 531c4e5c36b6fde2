"""Compile cache: different texts have different keys."""

from __future__ import annotations

import pytest

from diagnosis.model.compile_cache import cache_key


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("a", "b"), ("ab",)),
        (("a", "b"), ("b", "a")),
        (("a", "b"), ("a\\0b",)),  # a backslash and a 0 are no NUL byte
        (("a",), ("a", "")),
    ],
)
def test_keys_of_different_texts_differ(first: tuple[str, ...], second: tuple[str, ...]) -> None:
    assert cache_key(*first) != cache_key(*second)
    assert cache_key(*first) == cache_key(*first)
