"""Model agreement: correlation of recorded outputs with those simulated under the recorded inputs.

Smoothed rates of change are compared, because wrong loads and initial values cause slow drift.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import REFERENCE_TIME, reference_time
from diagnosis.data_quality.output_comparison import OutputComparison, ReferenceModel
from diagnosis.estimation.place_magnitude import rms
from engine.recordings.recording import Channel, Recording, crop, split_by_windows

GRID_STEP = 0.05
"""Step of the grid on which rates of change are compared, in reference times."""
SMOOTHING_STD = 0.2
"""Standard deviation of the Gaussian smoothing, in reference times.

With a reference time of 0.2 s it passes frequencies below about 4 Hz.
"""
GAIN_SMOOTHING_STD = 0.75
"""The same for gains, below about 1 Hz, without resonances."""
MAX_LAG = 5.0
"""Largest clock offset that is tried, in reference times."""
TRANSIENT_TIME = 4.0
"""Time after the start that is left out, because initial values differ, in reference times."""
MIN_TIME = 5.0
"""Shortest time that is compared, in reference times."""
MIN_CORRELATION = 0.75
"""Correlation from which two signals are the same motion."""
REVERSAL_MARGIN = 0.15
"""Margin by which the negated signal must correlate better: half a period of a sweep is similar."""
LAG_MARGIN = 0.02
"""Margin by which the correlation with a lag must exceed the one without."""
MAX_PIECE, MIN_PIECE = 50, 20
MAX_SIMULATED_TIME = 120
"""Longest and shortest piece, and total time, that is simulated, in reference times."""


@dataclass(frozen=True)
class OutputAgreement:
    """The agreement of outputs: measured = gain * simulated(t - lag).

    The gain is that of fast or of slow motion, whichever is nearer to 1. `level` is the ratio of
    root mean squares in the second half. `reference_time` is that of the signals [s].
    """

    recording: str
    channel: str
    gain: float
    lag: float
    correlation: float
    correlation_without_lag: float
    level: float = 1.0
    reference_time: float = REFERENCE_TIME

    @property
    def is_clear(self) -> bool:
        """Whether both are the same motion: |correlation| of at least `MIN_CORRELATION` (0.75)."""
        return abs(self.correlation) >= MIN_CORRELATION

    @property
    def correlation_gain(self) -> float:
        """The increase of the correlation's magnitude by the lag; negative if it decreases."""
        return abs(self.correlation) - abs(self.correlation_without_lag)

    @property
    def significant_lag(self) -> float:
        """The lag [s] if `is_clear` and `correlation_gain` exceeds `LAG_MARGIN` (0.02), else 0."""
        return self.lag if self.is_clear and self.correlation_gain > LAG_MARGIN else 0.0


def compare_with_simulation(
    recordings: Sequence[Recording], reference: ReferenceModel
) -> list[OutputAgreement]:
    """Return the agreement of each output with a simulation, in the piece of each window.

    Pieces are the most excited ones of 20 to 50 reference times, `MAX_SIMULATED_TIME` (120) in all.
    Inputs are thinned out to the step of the grid.
    """
    agreements: list[OutputAgreement] = []
    remaining_time = float(MAX_SIMULATED_TIME)
    mean_length = MAX_SIMULATED_TIME // max(1, len(recordings))
    piece_length = min(MAX_PIECE, max(MIN_PIECE, mean_length))
    for recording in recordings:
        for piece in split_by_windows(recording):
            if remaining_time <= 0.0:
                return agreements
            time = recording_reference_time(piece)
            part = _decimate_inputs(most_excited_piece(piece, piece_length * time), time)
            remaining_time -= float((part.end - part.start) / time)
            for name, compared in reference.simulate(part).comparisons.items():
                agreement = compare_signals(part.name, name, compared)
                if agreement:
                    agreements.append(agreement)
    return agreements


def recording_reference_time(piece: Recording) -> Fraction:
    """Return the reference time [s] of a recording; its period is that of the fastest output."""
    seconds = [one.seconds for one in piece.channels.values() if one.column.compare is not None]
    length = float(piece.end - piece.start)
    periods = [float(np.median(np.diff(one))) for one in seconds if len(one) > 1]
    return Fraction(f"{reference_time(min(periods, default=length), length):.6g}")


def most_excited_piece(piece: Recording, max_length: Fraction) -> Recording:
    """Return the most excited part of a recording of length `max_length` [s]."""
    if piece.end - piece.start <= max_length:
        return piece
    count = int(2 * (piece.end - piece.start) / max_length)
    starts = [
        piece.start + k * max_length / 2 for k in _places_with_samples(piece, max_length, count)
    ]
    best = max(starts, key=lambda start: _excitation_level(piece, start, start + max_length))
    return crop(piece, (best, min(piece.end, best + max_length)))


def _places_with_samples(piece: Recording, length: Fraction, count: int) -> list[int]:
    """Return the numbers, below `count`, of parts that may have samples, and the first part.

    Parts are as in `most_excited_piece`. The number of parts of a recording whose time leaps has no
    bound, the number of those with samples has one.
    """
    found = {0}
    for channel in piece.channels.values():
        places = np.floor((channel.seconds - float(piece.start)) / (0.5 * float(length)))
        found |= {int(k) + near for k in np.unique(places) for near in (-1, 0, 1)}
    return sorted(k for k in found if 0 <= k < count)


def _decimate_inputs(piece: Recording, time: Fraction) -> Recording:
    """Return a recording with every n-th sample of its inputs, at about the step of the grid."""
    step = Fraction(GRID_STEP).limit_denominator(1000) * time
    channels = dict(piece.channels)
    for name, channel in piece.channels.items():
        span = channel.times[-1] - channel.times[0]
        every = int(len(channel.times) / (span / step)) if span else 1
        if channel.column.to is not None and every > 1:
            part = slice(None, None, every)
            channels[name] = Channel(channel.column, channel.times[part], channel.values[part])
    return dataclasses.replace(piece, channels=channels)


def _excitation_level(piece: Recording, start: Fraction, end: Fraction) -> float:
    """Return the sum over inputs of the spread of changes over that of values."""
    total = 0.0
    for channel in piece.channels.values():
        inside = (channel.seconds >= float(start)) & (channel.seconds <= float(end))
        spread = float(np.std(channel.array)) or 1.0
        if inside.sum() > 2 and channel.column.to is not None:
            total += float(np.std(np.diff(channel.array[inside]))) / spread
    return total


def _smoothed_rate(
    times: Reals, values: Reals, grid: Reals, spread: float = SMOOTHING_STD
) -> Reals:
    """Return the rate of change after Gaussian smoothing, on the inner part of the grid.

    `spread` is in reference times, as is `GRID_STEP`.
    """
    width = _kernel_size(spread) // 2
    kernel = np.exp(-0.5 * (np.arange(-width, width + 1) * GRID_STEP / spread) ** 2)
    even = np.interp(grid, times, values)
    smooth = np.convolve(even, kernel / kernel.sum(), mode="valid")
    return np.gradient(smooth, grid[1] - grid[0])


def _kernel_size(spread: float) -> int:
    """Return the number of samples of the Gaussian kernel, 4 standard deviations to both sides."""
    return 2 * math.ceil(4.0 * spread / GRID_STEP) + 1


def compare_signals(
    recording: str, name: str, comparison: OutputComparison, spread: float = SMOOTHING_STD
) -> OutputAgreement | None:
    """Return the agreement of the rates of change of two signals.

    `spread` of the smoothing is in reference times. The gain is negative if the reversed signal
    correlates better by `REVERSAL_MARGIN`. The result is None if less than `MIN_TIME` remains, the
    simulation is not finite, or a rate is constant.
    """
    times = comparison.times
    if len(times) < 2 or not np.all(np.isfinite(comparison.simulated)):
        return None
    time = reference_time(float(np.median(np.diff(times))), float(times[-1] - times[0]))
    start, end, step = times[0] + TRANSIENT_TIME * time, times[-1], GRID_STEP * time
    if end - start < MIN_TIME * time:
        return None
    grid = np.arange(start, end, step)
    measured = _smoothed_rate(comparison.times, comparison.measured, grid, spread)
    simulated = _smoothed_rate(comparison.times, comparison.simulated, grid, spread)
    max_shift = min(round(MAX_LAG / GRID_STEP), len(grid) // 4)
    if len(measured) < 3 * max_shift or not measured.std() or not simulated.std():
        return None
    lags = range(-max_shift, max_shift + 1)
    pairs = {lag: _overlap(measured, simulated, lag) for lag in lags}
    correlations = {lag: _correlation(*pair) for lag, pair in pairs.items()}
    best = max(lags, key=lambda lag: correlations[lag])
    reversed_lag = min(lags, key=lambda lag: correlations[lag])
    if -correlations[reversed_lag] > correlations[best] + REVERSAL_MARGIN:
        best = reversed_lag
    alike = (pairs[best], *_low_frequency_rates(comparison, grid, best))
    ratios = [float(np.std(y)) / max(float(np.std(x)), 1e-12) for y, x in alike]
    gains = [min(max(ratio, 1e-6), 1e6) for ratio in ratios]
    gain = math.copysign(min(gains, key=lambda g: abs(math.log(g))), correlations[best])
    late = times > 0.5 * (start + end)
    level = rms(comparison.measured[late]) / max(rms(comparison.simulated[late]), 1e-12)
    both = correlations[best], correlations[0]
    return OutputAgreement(recording, name, gain, best * step, *both, level, time)


def _low_frequency_rates(
    comparison: OutputComparison, grid: Reals, lag: int
) -> list[tuple[Reals, Reals]]:
    """Return a list with both rates below the resonances at a lag; empty if too short."""
    shifted = grid + lag * (grid[1] - grid[0])
    kept = (shifted >= grid[0]) & (shifted <= grid[-1])
    if np.count_nonzero(kept) <= _kernel_size(GAIN_SMOOTHING_STD):
        return []
    times, spread = comparison.times, GAIN_SMOOTHING_STD
    measured = _smoothed_rate(times, comparison.measured, shifted[kept], spread)
    return [(measured, _smoothed_rate(times, comparison.simulated, grid[kept], spread))]


def _overlap(measured: Reals, simulated: Reals, lag: int) -> tuple[Reals, Reals]:
    """Return the parts of two signals that coincide at a lag [samples]."""
    if lag >= 0:
        return measured[lag:], simulated[: len(simulated) - lag]
    return measured[:lag], simulated[-lag:]


def _correlation(y: Reals, x: Reals) -> float:
    """Return the correlation coefficient of two signals; 0 if one is constant."""
    y, x = y - y.mean(), x - x.mean()
    size = float(np.sqrt((y @ y) * (x @ x)))
    return float(y @ x) / size if size else 0.0
