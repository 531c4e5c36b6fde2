"""Failure: why variants of a study are not done, the most frequent reasons first."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from sweep.table import StudyTable

NUMBER_PATTERN = re.compile(r"(?<![\w.])-?\d+(\.\d+)?([eE][-+]?\d+)?(?![\w.]*`)")
"""A number of a message: two that differ in numbers alone tell one reason."""


@dataclass(frozen=True)
class Failure:
    """A reason: `count` variants ended so; `message` is that of `number`, the first of them."""

    status: str
    message: str
    count: int
    number: int


def failures_of(table: StudyTable) -> tuple[Failure, ...]:
    """Return why the variants of a store that are not done are not."""
    if table.is_done.all():
        return ()
    states, names = table.read_categories("status")
    texts, messages = table.read_categories("message")
    numbers = table.read_reals("number").astype(np.int64)
    failures: dict[tuple[str, str], Failure] = {}
    reasons = np.stack((states, texts), axis=1)[~table.is_done]
    pairs, firsts, counts = np.unique(reasons, axis=0, return_index=True, return_counts=True)
    own = numbers[~table.is_done]
    for (state, text), first, count in sorted(
        zip(pairs.tolist(), own[firsts].tolist(), counts.tolist(), strict=True), key=_first_number
    ):
        key = names[state], NUMBER_PATTERN.sub("#", messages[text])
        known = failures.get(key)
        number = known.number if known else first
        message = known.message if known else messages[text]
        failures[key] = Failure(key[0], message, count + (known.count if known else 0), number)
    return tuple(sorted(failures.values(), key=lambda one: (-one.count, one.number)))


def _first_number(row: tuple[list[int], int, int]) -> int:
    return row[1]
