"""Series: a recording on the grid of its fastest channel, for prediction from sample to sample.

The grid begins where a compared channel has a value. Every value keeps its own sample: a channel
without one at a sample is NaN there if it is compared; an input holds its latest value, or runs
straight between its time stamps where the map says `hold: linear`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.noise import noise_of
from engine.recording import Channel, Recording, pieces
from language.experiment import RecordingMap
from language.graph import reachable
from language.model import Automaton

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

    @cached_property
    def first(self) -> Reals:
        """The first known value of each compared signal (seen,), NaN where there is none."""
        known = np.isfinite(self.measured)
        rows = np.argmax(known, axis=0)
        return np.asarray(self.measured[rows, np.arange(len(rows))], dtype=np.float64)

    @cached_property
    def noise(self) -> tuple[Reals, Reals]:
        """The standard deviation of the noise of the compared signals (seen,) and the inputs."""
        seen, inputs = (
            [noise_of(column) for column in values.T] for values in (self.measured, self.inputs)
        )
        return np.array(seen), np.array(inputs)


def compared(mapping: RecordingMap, automaton: Automaton) -> tuple[str, ...]:
    """Return the outputs that a map compares, in the order of the automaton."""
    wanted = {column.compare for column in mapping.columns.values() if column.compare}
    return tuple(name for name in automaton.outputs if name in wanted)


def pieces_of(
    recording: Recording, mapping: RecordingMap, automaton: Automaton, seen: Sequence[str]
) -> tuple[Series, ...]:
    """Return a recording on its grid, a series for each window that is used of it.

    Raises ValueError.
    """
    constants = {name: float(value) for name, (value, _) in mapping.constants.items()}
    declared = {
        name: float(thing.default)
        for name, thing in automaton.inputs.items()
        if thing.default is not None
    }
    known = {**declared, **constants}
    return tuple(
        series_of(piece, list(automaton.inputs), seen, known) for piece in pieces(recording)
    )


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
    short = next((channel for channel in used if len(channel.times) < 2), None)
    if short is not None:
        raise ValueError(f"{recording.name}: `{short.column.name}` has one sample only")
    end = min(channel.times[-1] for channel in used)
    start = _start([compared[name] for name in seen if name in compared], used)
    step = period or min(grid_period(channel.seconds) for channel in used)
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


def shows_inputs(automaton: Automaton, seen: Sequence[str]) -> bool:
    """Tell whether a compared output follows an input at once, with no state in between."""
    edges: dict[str, set[str]] = {}
    for mode in automaton.all_modes:
        for name, formula in mode.equations.items():
            edges.setdefault(name, set()).update(formula.reads)
    read = [reachable(edges, automaton.source_of(name)) for name in seen]
    return bool(set(automaton.inputs) & set().union(*read))


def paced(
    series: Sequence[Series], automaton: Automaton, seen: Sequence[str], is_linear: bool
) -> tuple[Series, ...]:
    """Return recordings whose inputs are held or run straight, thinned where that loses nothing.

    Where an output shows an input at once it does: what is shown with a mean was never measured.
    """
    if shows_inputs(automaton, seen):
        return tuple(dataclasses.replace(one, is_linear=is_linear) for one in series)
    return tuple(thinned(one, is_linear) for one in series)


def require_one_pace(series: Sequence[Series]) -> None:
    """Raise ValueError where recordings have samples at different rates."""
    rates = {one.period: f"{one.name} ({float(1 / one.period):g} Hz)" for one in series}
    if len(rates) > 1:
        named = ", ".join(rates.values())
        raise ValueError(f"recordings at different rates cannot be diagnosed together: {named}")


def thinned(series: Series, is_linear: bool = False) -> Series:
    """Return a fast recording at a slower pace: inputs are means over it, every n-th value is kept.

    What a driveline does is slower than `PACE`; a fit costs in proportion to the samples. A held
    input is the mean of what it is until the next sample, one that `is_linear` of what is around.
    """
    factor = max(1, int(PACE / series.period))
    count = series.count // factor
    inputs = series.inputs[: count * factor]
    if is_linear and factor > 1:
        around = np.pad(inputs, ((factor // 2, factor // 2), (0, 0)), mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(around, 2 * (factor // 2) + 1, axis=0)
        inputs = np.mean(windows[::factor], axis=-1)
    else:
        inputs = np.mean(inputs.reshape(count, factor, -1), axis=1)
    return Series(
        series.name,
        series.period * factor,
        series.start,
        np.ascontiguousarray(inputs),
        np.ascontiguousarray(series.measured[: count * factor : factor]),
        is_linear,
    )


def grid_period(times: Reals) -> Fraction:
    """Return the usual distance [s] of time stamps, of a whole rate where it is near one."""
    usual = float(np.median(np.diff(times)))
    rate = round(1.0 / usual)
    if rate > 0 and abs(rate * usual - 1.0) < 0.02:
        return Fraction(1, rate)
    return Fraction(usual).limit_denominator(1_000_000)


def _start(compared: Sequence[Channel], used: Sequence[Channel]) -> Fraction:
    """Return the first stamp [s] of the fastest compared channel at which all are known."""
    common = max(channel.times[0] for channel in used)
    fastest = min(compared, key=lambda channel: grid_period(channel.seconds))
    return next((time for time in fastest.times if time >= common), common)


def _places(channel: Channel, start: Fraction, step: Fraction) -> NDArray[np.int64]:
    """The sample that each value of a channel belongs to: the nearest one."""
    return np.rint((channel.seconds - float(start)) / float(step)).astype(np.int64)


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
    if channel.column.hold == "linear":
        grid = float(start) + float(step) * np.arange(count)
        return np.asarray(np.interp(grid, channel.seconds, channel.array), dtype=np.float64)
    places, values = _places(channel, start, step), channel.array
    latest = np.searchsorted(places, np.arange(count), side="right") - 1
    return values[np.maximum(latest, 0)]


def _placed(channel: Channel | None, start: Fraction, step: Fraction, count: int) -> Reals:
    found = np.full(count, np.nan)
    if channel is not None:
        places = _places(channel, start, step)
        inside = (places >= 0) & (places < count)
        found[places[inside]] = channel.array[inside]
    return found
