"""Series: a recording on the grid of its fastest channel, for prediction from sample to sample.

Every value keeps its own sample: a channel without one at a sample is NaN there if it is compared,
and holds its latest value if it is an input. Nothing is interpolated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from engine.recording import Channel, Recording

Reals = NDArray[np.float64]
PACE = Fraction(5, 1000)
"""Seconds between samples of a thinned recording."""


@dataclass(frozen=True)
class Series:
    """A recording as arrays: `inputs` (samples, inputs) held, `measured` (samples, seen) or NaN.

    `period` is the time [s] between samples, `start` that of the first one; `is_linear` says that
    inputs run straight from sample to sample: of a held one they are the steps.
    """

    name: str
    period: Fraction
    start: Fraction
    inputs: Reals
    measured: Reals
    is_linear: bool = False

    @property
    def count(self) -> int:
        """The number of samples."""
        return len(self.inputs)


def series_of(
    recording: Recording,
    inputs: Sequence[str],
    seen: Sequence[str],
    defaults: Mapping[str, float],
    period: Fraction | None = None,
) -> Series:
    """Return a recording on its grid, or on one of another `period`.

    Raises ValueError where it has too few samples.
    """
    fed = {c.column.to: c for c in recording.channels.values() if c.column.to is not None}
    compared = {c.column.compare: c for c in recording.channels.values() if c.column.compare}
    used = [*fed.values(), *(compared[name] for name in seen if name in compared)]
    start = max(channel.times[0] for channel in used)
    end = min(channel.times[-1] for channel in used)
    step = period or min(grid_period(channel.times) for channel in used)
    count = int((end - start) / step) + 1
    if count < 2:
        raise ValueError(f"{recording.name}: only {count} samples in common")
    held = np.stack([_held(fed.get(name), start, step, count, defaults, name) for name in inputs])
    known = np.stack([_placed(compared.get(name), start, step, count) for name in seen])
    return Series(
        recording.name,
        step,
        start,
        np.ascontiguousarray(held.T),
        np.ascontiguousarray(known.T),
    )


def thinned(series: Series) -> Series:
    """Return a fast recording at a slower pace: inputs are means over it, every n-th value is kept.

    What a driveline does is slower than `PACE`; a fit costs in proportion to the samples.
    """
    factor = int(PACE / series.period)
    if factor < 2:
        return series
    count = series.count // factor
    whole = series.inputs[: count * factor].reshape(count, factor, -1)
    return Series(
        series.name,
        series.period * factor,
        series.start,
        np.ascontiguousarray(np.mean(whole, axis=1)),
        np.ascontiguousarray(series.measured[: count * factor : factor]),
        False,
    )


def grid_period(times: Sequence[Fraction]) -> Fraction:
    """Return the usual distance [s] of time stamps, of a whole rate where it is near one."""
    gaps = np.diff(np.array([float(time - times[0]) for time in times]))
    usual = float(np.median(gaps))
    rate = round(1.0 / usual)
    if rate > 0 and abs(rate * usual - 1.0) < 0.02:
        return Fraction(1, rate)
    return Fraction(usual).limit_denominator(1_000_000)


def _places(channel: Channel, start: Fraction, step: Fraction) -> NDArray[np.int64]:
    """The sample that each value of a channel belongs to: the nearest one."""
    times = np.array([float(time - start) for time in channel.times])
    return np.rint(times / float(step)).astype(np.int64)


def _held(
    channel: Channel | None,
    start: Fraction,
    step: Fraction,
    count: int,
    defaults: Mapping[str, float],
    name: str,
) -> Reals:
    if channel is None:
        return np.full(count, defaults[name])
    places, values = _places(channel, start, step), np.array(channel.values, dtype=float)
    latest = np.searchsorted(places, np.arange(count), side="right") - 1
    return values[np.maximum(latest, 0)]


def _placed(channel: Channel | None, start: Fraction, step: Fraction, count: int) -> Reals:
    found = np.full(count, np.nan)
    if channel is not None:
        places = _places(channel, start, step)
        inside = (places >= 0) & (places < count)
        found[places[inside]] = np.array(channel.values, dtype=float)[inside]
    return found
