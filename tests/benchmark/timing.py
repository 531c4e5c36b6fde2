"""Timing: two things run in turn, many times, and the ratio of the processor time that they take.

Processor time, because the machine may be busy with other things; in turn, because its speed
changes; medians, because some runs are disturbed.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

SHORTEST = 0.02
"""Processor time [s] of one measurement: 2000 times what the clock resolves."""


@dataclass(frozen=True)
class Ratio:
    """The ratio of each pair: its median and quartiles, and the medians of both sides [s]."""

    median: float
    low: float
    high: float
    pairs: int
    seconds: float
    seconds_other: float


def time_interleaved(run: Callable[[], object], other: Callable[[], object], pairs: int) -> Ratio:
    """Return how much processor time one thing takes over another, each warmed up before."""
    counts = [_count(thing) for thing in (run, other)]
    ratios, ours, theirs = [], [], []
    for pair in range(pairs):
        measured = {}
        for side in (0, 1) if pair % 2 == 0 else (1, 0):
            measured[side] = seconds((run, other)[side], counts[side])
        ours.append(measured[0])
        theirs.append(measured[1])
        ratios.append(measured[0] / measured[1])
    low, median, high = quartiles(ratios)
    return Ratio(median, low, high, pairs, statistics.median(ours), statistics.median(theirs))


def seconds(run: Callable[[], object], count: int = 1) -> float:
    """Return the processor time [s] of one run, of all its threads."""
    start = time.process_time()
    for _ in range(count):
        run()
    return (time.process_time() - start) / count


def quartiles(values: list[float]) -> tuple[float, float, float]:
    """Return the lower quartile, the median and the upper quartile."""
    if len(values) < 2:
        return values[0], values[0], values[0]
    low, median, high = statistics.quantiles(values, n=4, method="inclusive")
    return low, median, high


def _count(run: Callable[[], object]) -> int:
    """Return how many runs make one measurement; the first one warms up."""
    run()
    return max(1, round(SHORTEST / max(seconds(run), 1e-6)))
