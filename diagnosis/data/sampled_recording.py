"""Sampled recordings: recordings on a uniform time grid, for one-step prediction.

Each measured value belongs to its nearest sample. An input is held (zero-order hold), or linear
between its time stamps with `hold: linear` in the recording map. An input with two values is held;
without `hold` the others may be either.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from diagnosis.data.array_types import Reals
from diagnosis.data.noise_estimate import noise_of
from diagnosis.data.time_resolution import time_resolution
from engine.recordings.recording import Channel, Recording, split_by_windows
from language.model.automaton import Automaton
from language.model.graph_algorithms import reachable
from language.model.system import RecordingMap

MAX_SLIP = Fraction(1, 10)
"""Slip of the grid against the last time stamp, in periods."""
MAX_SHARED_SLIP = Fraction(1, 4)
"""Slip at the end of a recording, in periods, with which it shares the grid of another one."""
DECIMATED_PERIOD = Fraction(5, 1000)
"""Longest period [s] to which faster recordings are decimated."""
REFERENCE_TIME = 0.2
"""Time [s] of the mechanical motions that most recordings show."""
MIN_PERIODS = 5.0
"""Periods in a reference time, and reference times in a recording."""
MIN_TIMES = 10.0
DECIMATED_COUNT = 1500
"""Samples that a recording of median length keeps when it is decimated."""
AVERAGED_PART = Fraction(1, 2)
"""Part of the `time_resolution` over which inputs are averaged.

The mean of a sine of frequency w over a time h is too small by (w h)^2 / 24: 0.3 % at w h = 1/4.
"""
BURN_IN = 2.5
"""Reference times at the start of a recording that are not scored, for the observer to settle."""

Hold = Literal["previous", "linear"] | None
"""Behaviour of an input between samples; None if it is not known."""


class UnusableRecordingError(ValueError):
    """A recording to which no model can be fitted: too few samples, or the model diverges on it."""


def reference_time(period: float, length: float) -> float:
    """Return the time [s] of the motions that a recording shows, for a period and a length [s].

    It is `REFERENCE_TIME` if that is between five periods and a tenth of the length, else the
    geometric mean of period and length.
    """
    is_shown = MIN_PERIODS * period <= REFERENCE_TIME <= length / MIN_TIMES
    return REFERENCE_TIME if is_shown else math.sqrt(period) * math.sqrt(length)


@dataclass(frozen=True)
class SampledRecording:
    """A recording on a uniform grid: `inputs` (samples, inputs) and `measured` (samples, outputs).

    `measured` is NaN where an output has no value; `period` and `start` are in s. An input whose
    entry of `holds` is None (or missing) is linear with `is_first_order_hold`, else constant.
    """

    name: str
    period: Fraction
    start: Fraction
    inputs: Reals
    measured: Reals
    is_first_order_hold: bool = False
    holds: tuple[Hold, ...] = ()
    burn_in: float = BURN_IN

    @property
    def count(self) -> int:
        """The number of samples."""
        return len(self.inputs)

    @property
    def linear_inputs(self) -> NDArray[np.int64]:
        """Whether each input is linear between samples, 1 or 0 (inputs,)."""
        known = self.holds or (None,) * self.inputs.shape[1]
        chosen: Hold = "linear" if self.is_first_order_hold else "previous"
        return np.array([(one or chosen) == "linear" for one in known], dtype=np.int64)

    @property
    def has_open_hold(self) -> bool:
        """Whether the behaviour of an input between samples depends on `is_first_order_hold`."""
        return None in self.holds or not self.holds

    @property
    def reference_time(self) -> float:
        """The time [s] of which burn-in, windows and memories of disturbances are multiples."""
        return reference_time(float(self.period), float(self.period) * max(self.count, 1))

    def sample_count(self, multiple: float) -> int:
        """Return the number of samples, at least 1, in a multiple of `reference_time`."""
        return max(1, round(multiple * self.reference_time / float(self.period)))

    @cached_property
    def first_measured(self) -> Reals:
        """The first known value of each compared output (outputs,), NaN if there is none."""
        known = np.isfinite(self.measured)
        rows = np.argmax(known, axis=0)
        return np.asarray(self.measured[rows, np.arange(len(rows))], dtype=np.float64)

    @cached_property
    def largest_measured(self) -> Reals:
        """The largest magnitude of each compared output (outputs,), 0 if it is never known."""
        known = np.where(np.isfinite(self.measured), np.abs(self.measured), 0.0)
        return np.asarray(np.max(known, axis=0), dtype=np.float64)

    @cached_property
    def largest_inputs(self) -> Reals:
        """The largest magnitude of each input (inputs,)."""
        return np.asarray(np.max(np.abs(self.inputs), axis=0), dtype=np.float64)

    @cached_property
    def noise(self) -> tuple[Reals, Reals]:
        """The noise standard deviations by `noise_of`: (outputs,) and (inputs,)."""
        seen = np.array([noise_of(column) for column in self.measured.T])
        return seen, np.array([noise_of(column) for column in self.inputs.T])


def compared_outputs(mapping: RecordingMap, automaton: Automaton) -> tuple[str, ...]:
    """Return the outputs of an automaton that a recording map compares, in its order."""
    mapped = {column.compare for column in mapping.columns.values() if column.compare}
    return tuple(name for name in automaton.outputs if name in mapped)


def sample_windows(
    recording: Recording, mapping: RecordingMap, automaton: Automaton, output_names: Sequence[str]
) -> tuple[SampledRecording, ...]:
    """Return one sampled recording for each window of a recording.

    Inputs without a channel have the constant of the map, else their default; KeyError without
    both. Raises ValueError if a window has too few samples.
    """
    known = {
        n: float(one.default) for n, one in automaton.inputs.items() if one.default is not None
    }
    known |= {name: float(value) for name, (value, _) in mapping.constants.items()}
    return tuple(
        sample_recording(piece, list(automaton.inputs), output_names, known)
        for piece in split_by_windows(recording)
    )


def sample_recording(
    recording: Recording,
    inputs: Sequence[str],
    output_names: Sequence[str],
    defaults: Mapping[str, float],
) -> SampledRecording:
    """Return a recording on the grid of its fastest channel.

    The grid begins at the first stamp of the fastest compared channel at which all channels are
    known, and ends with the channel that ends first. An input without a channel is constant at its
    value in `defaults` (KeyError), an output without one is NaN. Raises ValueError for fewer than
    two samples.
    """
    driven = {c.column.to: c for c in recording.channels.values() if c.column.to is not None}
    seen = {c.column.compare: c for c in recording.channels.values() if c.column.compare}
    compared = [seen[name] for name in output_names if name in seen]
    used = [*driven.values(), *compared]
    short = next((channel for channel in used if len(channel.times) < 2), None)
    if short is not None:
        raise UnusableRecordingError(f"{recording.name}: `{short.column.name}` has one sample only")
    end = min(channel.times[-1] for channel in used)
    common = max(channel.times[0] for channel in used)
    fastest = min(compared, key=lambda channel: grid_period(channel.times))
    start = next((time for time in fastest.times if time >= common), common)
    step = min(grid_period(channel.times) for channel in used)
    count = int((end - start) / step + MAX_SLIP) + 1
    if count < 2:
        raise UnusableRecordingError(f"{recording.name}: only {max(count, 0)} samples in common")
    input_values = np.empty((count, len(inputs)))
    for column, name in zip(input_values.T, inputs, strict=True):
        channel = driven.get(name)
        column[:] = _sample_input(channel, start, step, count) if channel else defaults[name]
    measured = [_sample_output(seen.get(name), start, step, count) for name in output_names]
    return SampledRecording(
        recording.name,
        step,
        start,
        input_values,
        np.stack(measured, axis=1),
        holds=tuple(
            _hold_of(driven.get(name), column)
            for name, column in zip(inputs, input_values.T, strict=True)
        ),
    )


def _hold_of(channel: Channel | None, values: Reals) -> Hold:
    """Return the hold of an input by its map; an input with at most two values is held."""
    if channel is not None and channel.column.hold is not None:
        return channel.column.hold
    return "previous" if np.all((values == np.min(values)) | (values == np.max(values))) else None


def has_feedthrough(automaton: Automaton, output_names: Sequence[str]) -> bool:
    """Return whether a compared output depends on an input algebraically, not through a state."""
    edges: dict[str, set[str]] = {}
    for mode in automaton.all_modes:
        for name, formula in mode.equations.items():
            edges.setdefault(name, set()).update(formula.reads)
    read = [reachable(edges, automaton.output_source(name)) for name in output_names]
    return bool(set(automaton.inputs) & set().union(*read))


def open_holds(series: Sequence[SampledRecording]) -> tuple[bool, ...]:
    """Return the values of `is_first_order_hold` that differ in their meaning for recordings."""
    return (True, False) if any(one.has_open_hold for one in series) else (False,)


def resample(
    series: Sequence[SampledRecording],
    automaton: Automaton,
    output_names: Sequence[str],
    is_first_order_hold: bool,
    period: Fraction | None = None,
) -> tuple[SampledRecording, ...]:
    """Return recordings with the given hold, decimated if no compared output has feed-through.

    An output that follows the mean of an input was never measured. The default `period` [s] follows
    the dynamics (`AVERAGED_PART` of `time_resolution`), is at most `DECIMATED_PERIOD` and leaves
    `DECIMATED_COUNT` samples. Raises ValueError as `decimate`.
    """
    if has_feedthrough(automaton, output_names):
        return tuple(
            dataclasses.replace(one, is_first_order_hold=is_first_order_hold) for one in series
        )
    if period is None:
        length = sorted(one.count * one.period for one in series)[len(series) // 2]
        longest = min(DECIMATED_PERIOD, length / DECIMATED_COUNT)
        period = AVERAGED_PART * time_resolution(automaton, longest / AVERAGED_PART)
    return tuple(decimate(one, is_first_order_hold, period) for one in series)


def share_period(
    series: Sequence[SampledRecording], period: Fraction | None = None
) -> tuple[SampledRecording, ...]:
    """Return recordings interpolated to the given period [s], or to the longest one of them.

    Periods within `MAX_SHARED_SLIP` are equal; that of the most samples is taken.
    """
    if period is None:
        different: list[Fraction] = []
        for one in sorted(series, key=lambda one: -one.count):
            if not any(_has_period(one, known) for known in different):
                different.append(one.period)
        period = max(different)
    return tuple(
        dataclasses.replace(one, period=period)
        if _has_period(one, period)
        else interpolate(one, period)
        for one in series
    )


def _has_period(series: SampledRecording, period: Fraction) -> bool:
    """Return whether the last sample moves by at most `MAX_SHARED_SLIP` with another period."""
    return abs(series.period - period) * series.count <= MAX_SHARED_SLIP * period


def interpolate(series: SampledRecording, period: Fraction) -> SampledRecording:
    """Return a recording at another period [s], with signals linear between its samples.

    A "previous" input keeps its value until the next sample. Samples next to NaN are NaN.
    """
    count = int((series.count - 1) * series.period / period) + 1
    places = np.arange(count) * float(period / series.period)
    before = np.minimum(places.astype(np.intp), max(series.count - 2, 0))
    after = np.minimum(before + 1, series.count - 1)
    part = (places - before)[:, np.newaxis]

    def at_places(values: Reals) -> Reals:
        step = np.where(part > 0.0, part * (values[after] - values[before]), 0.0)
        return np.ascontiguousarray(values[before] + step)

    inputs = at_places(series.inputs)
    held = [k for k, hold in enumerate(series.holds) if hold == "previous"]
    inputs[:, held] = series.inputs[before][:, held]
    return dataclasses.replace(
        series, period=period, inputs=inputs, measured=at_places(series.measured)
    )


def decimate(
    series: SampledRecording,
    is_first_order_hold: bool = False,
    longest: Fraction = DECIMATED_PERIOD,
) -> SampledRecording:
    """Return a recording decimated by an integer factor n, to a period of at most `longest` [s].

    Outputs are the first of each n samples (no filter). A held input is the mean of the n samples,
    one with first-order hold the mean over a centred window. Raises ValueError below n samples.
    """
    series = dataclasses.replace(series, is_first_order_hold=is_first_order_hold)
    factor = max(1, int(longest / series.period))
    count = series.count // factor
    if count == 0:
        raise UnusableRecordingError(
            f"{series.name}: only {series.count} samples, {factor} are averaged to one"
        )
    recorded = series.inputs[: count * factor]
    inputs = np.mean(recorded.reshape(count, factor, recorded.shape[1]), axis=1)
    linear = np.flatnonzero(series.linear_inputs)
    if len(linear) and factor > 1:
        around = np.pad(recorded[:, linear], ((factor // 2, factor // 2), (0, 0)), mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(around, 2 * (factor // 2) + 1, axis=0)
        inputs[:, linear] = np.mean(windows[::factor], axis=-1)
    return dataclasses.replace(
        series,
        period=series.period * factor,
        inputs=np.ascontiguousarray(inputs),
        measured=np.ascontiguousarray(series.measured[: count * factor : factor]),
    )


def grid_period(times: Sequence[Fraction]) -> Fraction:
    """Return the period [s] of a uniform grid through increasing time stamps (at least two).

    Gaps and jitter do not count. It is the simplest fraction with which the last stamp moves by at
    most `MAX_SLIP` of a period; uniform stamps have their exact period.
    """
    first = times[1] - times[0]
    if all(late - early == first for early, late in pairwise(times)):
        return first
    seconds = np.array([float(time) for time in times])
    differences = np.diff(seconds)
    usual = float(np.median(differences))
    count = int(np.sum(np.maximum(np.rint(differences / usual), 1.0)))
    period = (times[-1] - times[0]) / count
    slip = MAX_SLIP * period / count
    return simplest_fraction(period - slip, period + slip)


def simplest_fraction(low: Fraction, high: Fraction) -> Fraction:
    """Return the fraction with the smallest denominator in an interval, 0 < low <= high."""
    whole = low.numerator // low.denominator
    if low == whole:
        return Fraction(whole)
    if whole + 1 <= high:
        return Fraction(whole + 1)
    return whole + 1 / simplest_fraction(1 / (high - whole), 1 / (low - whole))


def _sample_indices(channel: Channel, start: Fraction, step: Fraction) -> NDArray[np.int64]:
    """Return the nearest grid index of each value of a channel; it may be outside the grid."""
    return np.rint((channel.seconds - float(start)) / float(step)).astype(np.int64)


def _sample_input(channel: Channel, start: Fraction, step: Fraction, count: int) -> Reals:
    """Return an input on the grid (count,), held or interpolated."""
    if channel.column.hold == "linear":
        grid = float(start) + float(step) * np.arange(count)
        return np.asarray(np.interp(grid, channel.seconds, channel.array), dtype=np.float64)
    places, values = _sample_indices(channel, start, step), channel.array
    latest = np.searchsorted(places, np.arange(count), side="right") - 1
    return values[np.maximum(latest, 0)]


def _sample_output(channel: Channel | None, start: Fraction, step: Fraction, count: int) -> Reals:
    """Return an output on the grid (count,), NaN at samples without a value."""
    values = np.full(count, np.nan)
    if channel is not None:
        places = _sample_indices(channel, start, step)
        inside = (places >= 0) & (places < count)
        values[places[inside]] = channel.array[inside]
    return values
