"""Redundant speeds: recorded speeds of one motion, compared with each other without a model."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from statistics import median

import numpy as np

from diagnosis.data_quality.excitation import is_speed
from diagnosis.data_quality.finding import Finding, Severity
from diagnosis.data_quality.model_agreement import (
    GAIN_SMOOTHING_STD,
    OutputAgreement,
    compare_signals,
)
from diagnosis.data_quality.output_comparison import OutputComparison
from diagnosis.data_quality.unit_sign_clock_errors import (
    CLOCK_TOLERANCE,
    OFFSET_WARNING,
    SHARED_FRACTION,
)
from engine.recordings.recording import Channel, Recording, split_by_windows

MIN_CORRELATION = 0.9
"""Correlation of the rates of change from which two speeds are one motion."""
MAX_OFFSET = 3.0
"""A larger offset, in reference times, is a period of the motion rather than of the clock."""


def find_redundant_speeds(recordings: Sequence[Recording]) -> list[Finding]:
    """Return findings on pairs of speeds that agree except for a sign or a clock offset.

    Speeds agree from `MIN_CORRELATION` on, in the longest window of a recording. A finding needs
    `SHARED_FRACTION` of these recordings; it is a warning if there is one only.
    """
    found: dict[tuple[str, str], list[OutputAgreement]] = {}
    for recording in recordings:
        speeds = [channel for channel in recording.channels.values() if is_speed(channel)]
        for first, second in itertools.combinations(speeds, 2):
            agreement = _compare_speeds(recording, first, second)
            if agreement is not None and abs(agreement.correlation) >= MIN_CORRELATION:
                key = first.column.name, second.column.name
                found.setdefault(key, []).append(agreement)
    return [
        finding for pair, each in found.items() for finding in _redundancy_findings(*pair, each)
    ]


def _compare_speeds(
    recording: Recording, first: Channel, second: Channel
) -> OutputAgreement | None:
    """Return the agreement of two speeds in the longest window; None if they hardly overlap."""
    piece = max(split_by_windows(recording), key=lambda piece: piece.end - piece.start)
    one = piece.channels.get(first.column.name)
    other = piece.channels.get(second.column.name)
    if one is None or other is None:
        return None
    inside = (other.seconds >= one.seconds[0]) & (other.seconds <= one.seconds[-1])
    if inside.sum() < 2:
        return None
    times = other.seconds[inside]
    same = np.interp(times, one.seconds, one.array)
    compared = OutputComparison(times, other.array[inside], same)
    return compare_signals(recording.name, other.column.name, compared, GAIN_SMOOTHING_STD)


def _redundancy_findings(
    first: str, second: str, agreements: Sequence[OutputAgreement]
) -> list[Finding]:
    """Return the finding on a pair of speeds, if most recordings agree on a sign or an offset."""
    both = f"`{first}` and `{second}` are one motion"
    severity: Severity = "error" if len(agreements) > 1 else "warning"
    where = agreements[0].recording if len(agreements) == 1 else ""
    if sum(agreement.gain < 0.0 for agreement in agreements) > SHARED_FRACTION * len(agreements):
        return [Finding("sign", where, second, f"{both} with opposite signs", severity)]
    lag = median(agreement.significant_lag for agreement in agreements)
    unit = median(agreement.time_unit for agreement in agreements)
    near = CLOCK_TOLERANCE * unit
    same = sum(abs(agreement.significant_lag - lag) <= near for agreement in agreements)
    is_offset = OFFSET_WARNING * unit <= abs(lag) <= MAX_OFFSET * unit
    if is_offset and same > SHARED_FRACTION * len(agreements):
        late = second if lag > 0.0 else first
        text = f"{both}, but the clock of `{late}` is {abs(lag):.2f} s late"
        return [Finding("clock_offset", where, late, text, severity)]
    return []
