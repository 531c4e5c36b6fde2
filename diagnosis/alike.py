"""Alike: recorded speeds that are one motion, such as a motor and its wheel; without a model."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from statistics import median

import numpy as np

from diagnosis.consistency import SMOOTH_GAIN, Relation, relation_of
from diagnosis.disagreement import MOST, OFFSET_WARNING, SAME_CLOCK
from diagnosis.excitation import is_speed
from diagnosis.finding import Finding, Severity
from diagnosis.free_run import Compared
from engine.recording import Channel, Recording, pieces

ONE_MOTION = 0.9
"""Correlation of the rates of change from which two speeds are taken for one motion."""
LARGEST_OFFSET = 0.6
"""Larger ones [s] are periods of the motion rather than clocks."""


def alike(recordings: Sequence[Recording]) -> list[Finding]:
    """Return what is to be told of speeds that go together but for a sign or a clock.

    What is so in most of several recordings is an error, in a single one a warning.
    """
    found: dict[tuple[str, str], list[Relation]] = {}
    for recording in recordings:
        speeds = [channel for channel in recording.channels.values() if is_speed(channel)]
        for first, second in itertools.combinations(speeds, 2):
            relation = _relation(recording, first, second)
            if relation is not None and abs(relation.correlation) >= ONE_MOTION:
                key = first.column.name, second.column.name
                found.setdefault(key, []).append(relation)
    return [finding for pair, each in found.items() for finding in _told(*pair, each)]


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


def _told(first: str, second: str, each: Sequence[Relation]) -> list[Finding]:
    both = f"`{first}` and `{second}` are one motion"
    severity: Severity = "error" if len(each) > 1 else "warning"
    where = each[0].recording if len(each) == 1 else ""
    if sum(relation.gain < 0.0 for relation in each) > MOST * len(each):
        return [Finding("sign", where, second, f"{both} with opposite signs", severity)]
    lag = median(relation.believed_lag for relation in each)
    same = sum(abs(relation.believed_lag - lag) <= SAME_CLOCK for relation in each)
    if OFFSET_WARNING <= abs(lag) <= LARGEST_OFFSET and same > MOST * len(each):
        late = second if lag > 0.0 else first
        text = f"{both}, but the clock of `{late}` is {abs(lag):.2f} s late"
        return [Finding("clock_offset", where, late, text, severity)]
    return []
