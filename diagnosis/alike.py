"""Alike: recorded speeds that are one motion, such as a motor and its wheel; without a model."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from diagnosis.consistency import SMOOTH_GAIN, Relation, relation_of
from diagnosis.disagreement import OFFSET_ERROR, OFFSET_WARNING
from diagnosis.excitation import is_speed
from diagnosis.finding import Finding, Severity
from diagnosis.free_run import Compared
from engine.recording import Channel, Recording, pieces

ONE_MOTION = 0.9
"""Correlation of the rates of change from which two speeds are taken for one motion."""


def alike(recordings: Sequence[Recording]) -> list[Finding]:
    """Return what is to be told of speeds that go together but for a sign or a clock."""
    found = []
    for recording in recordings:
        speeds = [channel for channel in recording.channels.values() if is_speed(channel)]
        for first, second in itertools.combinations(speeds, 2):
            relation = _relation(recording, first, second)
            if relation is not None and abs(relation.correlation) >= ONE_MOTION:
                found += _told(relation, first.column.name)
    return found


def _relation(recording: Recording, first: Channel, second: Channel) -> Relation | None:
    """Return how the second speed goes with the first in the longest piece."""
    piece = max(pieces(recording), key=lambda piece: piece.end - piece.start)
    one = piece.channels.get(first.column.name)
    other = piece.channels.get(second.column.name)
    if one is None or other is None:
        return None
    start = max(one.seconds[0], other.seconds[0])
    end = min(one.seconds[-1], other.seconds[-1])
    inside = (other.seconds >= start) & (other.seconds <= end)
    if inside.sum() < 2:
        return None
    times = other.seconds[inside]
    same = np.interp(times, one.seconds, one.array)
    compared = Compared(other.column.name, times, other.array[inside], same)
    return relation_of(recording.name, other.column.name, compared, SMOOTH_GAIN)


def _told(relation: Relation, first: str) -> list[Finding]:
    both = f"`{first}` and `{relation.channel}` are one motion"
    lag = relation.believed_lag
    if relation.gain < 0.0:
        text = f"{both} with opposite signs"
        return [Finding("sign", relation.recording, relation.channel, text, "warning")]
    if abs(lag) >= OFFSET_WARNING:
        late = relation.channel if lag > 0.0 else first
        text = f"{both}, but the clock of `{late}` is {abs(lag):.2f} s late"
        severity: Severity = "error" if abs(lag) >= OFFSET_ERROR else "warning"
        return [Finding("clock_offset", relation.recording, late, text, severity)]
    return []
