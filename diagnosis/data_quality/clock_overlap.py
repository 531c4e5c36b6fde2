"""Clock overlap: channels of a recording whose time stamps share no time, or hardly any."""

from __future__ import annotations

import itertools

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data_quality.channel import MIN_SAMPLES
from diagnosis.data_quality.finding import Finding
from diagnosis.data_quality.outlier import shortest_long_pause
from engine.recordings.recording import Channel, Recording

MIN_SHARED_FRACTION = 0.01
"""Fraction of the longer of two spans that two clocks must share; ms as s give at most 0.001."""
ONE_CLOCK = ": do their clocks have one unit and one start?"
"""Question at the end of a finding."""


def find_clock_mismatches(recording: Recording) -> list[Finding]:
    """Return an error for the first channels of each pair of clocks with `lacking_overlap`."""
    found: dict[tuple[str, str], Finding] = {}
    channels = [one for one in recording.channels.values() if is_continuous(one.seconds)]
    for first, second in itertools.combinations(channels, 2):
        clocks = min(first.clock, second.clock), max(first.clock, second.clock)
        amount = lacking_overlap(first.seconds, second.seconds, first.clock != second.clock)
        if amount and clocks not in found:
            text = f"{_describe(first)} and {_describe(second)} have {amount} in common"
            text += ONE_CLOCK
            found[clocks] = Finding("time", recording.name, second.column.name, text, "error")
    return list(found.values())


def lacking_overlap(first: Reals, second: Reals, is_other_clock: bool) -> str:
    """Return the common time of two sequences of stamps [s] as text; "" if they share enough.

    They must overlap, those of two clocks by `MIN_SHARED_FRACTION` (1 %) of the longer.
    """
    shared = float(min(first[-1], second[-1]) - max(first[0], second[0]))
    least = MIN_SHARED_FRACTION * max(_duration(first), _duration(second))
    if shared >= (least if is_other_clock else 0.0):
        return ""
    return f"only {shared:.3g} s" if shared > 0.0 else "no time"


def is_continuous(stamps: Reals) -> bool:
    """Return whether stamps [s] are at least `MIN_SAMPLES` (10) and do not leap."""
    if len(stamps) < MIN_SAMPLES:
        return False
    return float(np.diff(stamps).max()) < shortest_long_pause(_duration(stamps))


def format_span(stamps: Reals) -> str:
    """Return the first and the last stamp as text, `0 s to 9 s`."""
    return f"{stamps[0]:.6g} s to {stamps[-1]:.6g} s"


def _duration(stamps: Reals) -> float:
    """Return the time [s] from the first stamp to the last one."""
    return float(stamps[-1] - stamps[0])


def _describe(channel: Channel) -> str:
    """Return a channel with its time column, if it has one, and its first and last stamp."""
    clock = f"time `{channel.clock}`, " if channel.clock else ""
    return f"`{channel.column.name}` ({clock}{format_span(channel.seconds)})"
