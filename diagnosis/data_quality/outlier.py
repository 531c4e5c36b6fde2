"""Outliers: single values and time stamps of a recording that are far from all others."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.data.noise_estimate import MAD_TO_STD
from diagnosis.data_quality.channel import si_factor
from diagnosis.data_quality.finding import Finding
from engine.recordings.recording import Channel, Recording, split_by_windows
from language.model.automaton import Automaton

MAX_VALUE = 1e15
"""A larger value [SI] was not measured; its square still fits into a double."""
RANGE_FACTOR = 3.0
"""Multiple of the range of the median-filtered signal from which a single value is an outlier."""
NOISE_FACTOR = 20.0
"""The same in standard deviations of the noise."""
MEDIAN_SAMPLES = 5
"""Samples of the median filter, which removes what is shorter than half of them."""
MAX_PAUSE_FRACTION = Fraction(1, 2)
"""Fraction of a recording's time from which a pause is a wrong stamp, or two recordings."""
MIN_PAUSE = 2
"""Shortest such pause [s]."""
SECONDS_PER_HOUR = 3600.0


def drop_huge_values(recording: Recording) -> Recording:
    """Return a recording without NaN, values beyond `MAX_VALUE` (1e15) and empty channels."""
    channels = {}
    for name, channel in recording.channels.items():
        known = np.abs(channel.array) <= MAX_VALUE
        if known.all():
            channels[name] = channel
        elif known.any():
            kept = np.flatnonzero(known)
            times = tuple(channel.times[k] for k in kept)
            channels[name] = Channel(channel.column, times, tuple(channel.array[kept].tolist()))
    return dataclasses.replace(recording, channels=channels)


def find_outliers(recording: Recording, automaton: Automaton | None) -> list[Finding]:
    """Return an error for each channel with outliers, which names the largest one and its time.

    Outliers are beyond `MAX_VALUE`; else far from the median-filtered signal. A declared range of
    the compared state is added if the value exceeds it.
    """
    found = []
    for name, channel in recording.channels.items():
        huge = np.abs(channel.array) > MAX_VALUE
        far = huge if huge.any() else _is_outlier(channel.array)
        if not far.any():
            continue
        worst = int(np.argmax(np.where(far, np.abs(channel.array), -1.0)))
        factor = si_factor(channel)
        value = f"{channel.values[worst] / factor:.4g} {channel.column.unit.text}".strip()
        text = f"is {value} at {channel.seconds[worst]:.6g} s"
        if far.sum() > 1:
            text += f", one of {int(far.sum())} such values"
        text += ": nothing measured is so large" if huge.any() else ", far from all around it"
        text += _range_text(channel, channel.values[worst], automaton, factor)
        found.append(Finding("outlier", recording.name, name, text, "error"))
    return found


def _is_outlier(values: Reals) -> NDArray[np.bool_]:
    """Return the mask (samples,) of values far from the median-filtered signal, if it varies."""
    if len(values) < 4 * MEDIAN_SAMPLES:
        return np.zeros(len(values), dtype=np.bool_)
    around = np.pad(values, MEDIAN_SAMPLES // 2, mode="edge")
    lasting = np.median(np.lib.stride_tricks.sliding_window_view(around, MEDIAN_SAMPLES), axis=1)
    distance = np.abs(values - lasting)
    noise = MAD_TO_STD * float(np.median(distance))
    least = max(RANGE_FACTOR * float(np.ptp(lasting)), NOISE_FACTOR * noise)
    return distance > least if np.ptp(lasting) > 0.0 else np.zeros(len(values), dtype=np.bool_)


def _range_text(channel: Channel, value: float, automaton: Automaton | None, factor: float) -> str:
    """Return the declared range as text if a value of a compared state is outside it, else ""."""
    output = channel.column.compare
    if automaton is None or output is None or output not in automaton.outputs:
        return ""
    state = automaton.states.get(automaton.output_source(output))
    if state is None or state.range is None or state.range[0] <= value <= state.range[1]:
        return ""
    low, high = (float(one) / factor for one in state.range)
    return f" (its range is {low:g} to {high:g})"


def find_long_pauses(recording: Recording) -> list[Finding]:
    """Return an error for the first pause in all stamps of each window of `shortest_long_pause`."""
    found = []
    for piece in split_by_windows(recording):
        least = shortest_long_pause(float(piece.end - piece.start))
        stamps = [channel.seconds for channel in piece.channels.values()]
        every = np.unique(np.concatenate(stamps or [np.zeros(0)]))
        for k in np.flatnonzero(np.diff(every) >= least)[:1]:
            start, end = float(every[k]), float(every[k + 1])
            leap = f"{start:.6g} s to {end:.6g} s ({_format_duration(end - start)})"
            why = "a wrong time stamp, or two recordings in one file"
            text = f"time leaps from {leap}: {why}"
            found.append(Finding("leap", recording.name, "", text, "error", (start, end)))
    return found


def shortest_long_pause(duration: float) -> float:
    """Return the length [s] from which a pause in stamps of a duration [s] is long."""
    return max(float(MAX_PAUSE_FRACTION) * duration, MIN_PAUSE)


def _format_duration(seconds: float) -> str:
    """Return a duration in seconds, hours or days."""
    if seconds < SECONDS_PER_HOUR:
        return f"{seconds:.4g} s"
    hours = seconds / SECONDS_PER_HOUR
    return f"{hours:.4g} h" if hours < 240 else f"{hours / 24:.4g} days"
