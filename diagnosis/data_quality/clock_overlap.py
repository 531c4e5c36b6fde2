"""Clock overlap: channels of a recording whose time stamps share no time, or hardly any."""

from __future__ import annotations

import itertools

import numpy as np

from diagnosis.data_quality.finding import Finding
from diagnosis.data_quality.outlier import shortest_long_pause
from engine.recordings.recording import Channel, Recording

MIN_SHARED_FRACTION = 0.01
"""Fraction of the longer of two spans that two clocks must share; ms as s give at most 0.001."""
MIN_SAMPLES = 10
"""Smallest number of samples of a compared span; an input that is held may have a single one."""


def find_clock_mismatches(recording: Recording) -> list[Finding]:
    """Return an error for the first pair of channels, per pair of clocks, that share too little
    time.

    The spans of two channels must overlap; those of two time columns must have at least
    `MIN_SHARED_FRACTION` (1 %) of the longer one in common. Channels with fewer than `MIN_SAMPLES`
    (10) samples and channels whose own stamps leap are left out.
    """
    found: dict[tuple[str, str], Finding] = {}
    channels = [channel for channel in recording.channels.values() if _has_span(channel)]
    for first, second in itertools.combinations(channels, 2):
        clocks = min(first.clock, second.clock), max(first.clock, second.clock)
        shared = min(first.seconds[-1], second.seconds[-1])
        shared -= max(first.seconds[0], second.seconds[0])
        least = 0.0
        if first.clock != second.clock:
            least = MIN_SHARED_FRACTION * max(_duration(first), _duration(second))
        if shared >= least or clocks in found:
            continue
        amount = f"only {shared:.3g} s" if shared > 0.0 else "no time"
        text = f"{_describe(first)} and {_describe(second)} have {amount} in common"
        text += ": do their clocks have one unit and one start?"
        found[clocks] = Finding("time", recording.name, second.column.name, text, "error")
    return list(found.values())


def _has_span(channel: Channel) -> bool:
    """Return whether a channel has enough samples, and stamps that do not leap."""
    if len(channel.times) < MIN_SAMPLES:
        return False
    return float(np.diff(channel.seconds).max()) < shortest_long_pause(_duration(channel))


def _duration(channel: Channel) -> float:
    """Return the time [s] from the first stamp of a channel to its last one."""
    return float(channel.seconds[-1] - channel.seconds[0])


def _describe(channel: Channel) -> str:
    """Return a channel with its time column, if it has one, and its first and last stamp."""
    clock = f"time `{channel.clock}`, " if channel.clock else ""
    span = f"{channel.seconds[0]:.6g} s to {channel.seconds[-1]:.6g} s"
    return f"`{channel.column.name}` ({clock}{span})"
