"""Outlier: values that nothing measured has, and stamps of time that are far from all others."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from diagnosis.finding import Finding
from diagnosis.noise import MAD
from engine.recording import Channel, Recording, pieces
from language.model import Automaton

Values = NDArray[np.float64]

LARGEST = 1e15
"""A value (SI) above this was not measured; its square still has a meaning to a computer."""
FAR = 3.0
"""Spans of all that lasts from which a value that comes and goes at once is an outlier."""
OUT_OF_NOISE = 20.0
"""The same in standard deviations of the noise."""
WIDTH = 5
"""Samples over which the median is taken: what lasts for less than half of them comes and goes."""
MOST_PAUSED = Fraction(1, 2)
"""Share of the time of a recording from which a pause is a wrong stamp, or two recordings."""
LEAST_PAUSED = 2
"""Seconds below which no pause is one."""
SECONDS_PER_HOUR = 3600.0


def without_huge(recording: Recording) -> Recording:
    """Return a recording without the samples that are huge, nor channels of nothing else."""
    channels = {}
    for name, channel in recording.channels.items():
        known = np.abs(channel.array) <= LARGEST
        if known.all():
            channels[name] = channel
        elif known.any():
            kept = np.flatnonzero(known)
            times = tuple(channel.times[k] for k in kept)
            channels[name] = Channel(channel.column, times, tuple(channel.array[kept].tolist()))
    return dataclasses.replace(recording, channels=channels)


def outliers(recording: Recording, automaton: Automaton | None) -> list[Finding]:
    """Return the channels that have values which come and go at once, far from all others."""
    found = []
    for name, channel in recording.channels.items():
        huge = np.abs(channel.array) > LARGEST
        far = huge if huge.any() else _far(channel.array)
        if not far.any():
            continue
        worst = int(np.argmax(np.where(far, np.abs(channel.array), -1.0)))
        factor = float(channel.column.unit.factor * channel.column.scale[0])
        value = f"{channel.values[worst] / factor:.4g} {channel.column.unit.text}".strip()
        text = f"is {value} at {channel.seconds[worst]:.6g} s"
        if far.sum() > 1:
            text += f", one of {int(far.sum())} such values"
        text += ": nothing measured is so large" if huge.any() else ", far from all around it"
        text += _declared(channel, channel.values[worst], automaton, factor)
        found.append(Finding("outlier", recording.name, name, text, "error"))
    return found


def _far(values: Values) -> NDArray[np.bool_]:
    """Tell which values are far from those around them, measured by what lasts."""
    if len(values) < 4 * WIDTH:
        return np.zeros(len(values), dtype=np.bool_)
    around = np.pad(values, WIDTH // 2, mode="edge")
    lasting = np.median(np.lib.stride_tricks.sliding_window_view(around, WIDTH), axis=1)
    distance = np.abs(values - lasting)
    noise = MAD * float(np.median(distance))
    least = max(FAR * float(np.ptp(lasting)), OUT_OF_NOISE * noise)
    return distance > least if np.ptp(lasting) > 0.0 else np.zeros(len(values), dtype=np.bool_)


def _declared(channel: Channel, value: float, automaton: Automaton | None, factor: float) -> str:
    """Return what the automaton says of a value that is out of the range of its state."""
    output = channel.column.compare
    if automaton is None or output is None or output not in automaton.outputs:
        return ""
    state = automaton.states.get(automaton.source_of(output))
    if state is None or state.range is None or state.range[0] <= value <= state.range[1]:
        return ""
    low, high = (float(one) / factor for one in state.range)
    return f" (its range is {low:g} to {high:g})"


def pauses(recording: Recording) -> list[Finding]:
    """Return where the stamps of a recording leap: a wrong stamp, or two recordings in one."""
    found = []
    for piece in pieces(recording):
        least = max(float(MOST_PAUSED * (piece.end - piece.start)), LEAST_PAUSED)
        stamps = [channel.seconds for channel in piece.channels.values()]
        every = np.unique(np.concatenate(stamps or [np.zeros(0)]))
        for k in np.flatnonzero(np.diff(every) >= least)[:1]:
            start, end = float(every[k]), float(every[k + 1])
            text = f"time leaps from {start:.6g} s to {end:.6g} s ({_length(end - start)}): "
            text += "a wrong time stamp, or two recordings in one file"
            found.append(Finding("leap", recording.name, "", text, "error", (start, end)))
    return found


def _length(seconds: float) -> str:
    if seconds < SECONDS_PER_HOUR:
        return f"{seconds:.4g} s"
    hours = seconds / SECONDS_PER_HOUR
    return f"{hours:.4g} h" if hours < 240 else f"{hours / 24:.4g} days"
