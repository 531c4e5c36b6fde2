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
from diagnosis.data_quality.output_comparison import OutputComparison, ReferenceModel
from diagnosis.estimation.place_magnitude import rms
from engine.recordings.recording import Channel, Recording, crop, split_by_windows

GRID_STEP = 0.01
"""Step [s] of the grid on which rates of change are compared."""
SMOOTHING_STD = 0.04
"""Standard deviation [s] of the Gaussian smoothing, which passes frequencies below about 4 Hz."""
GAIN_SMOOTHING_STD = 0.15
"""The same for gains, below about 1 Hz, without resonances."""
MAX_LAG = 1.0
"""Largest clock offset [s] that is tried."""
TRANSIENT_TIME = 0.8
"""Time [s] after the start that is left out, because initial values differ."""
MIN_CORRELATION = 0.75
"""Correlation from which two signals are the same motion."""
REVERSAL_MARGIN = 0.15
"""Margin by which the negated signal must correlate better: half a period of a sweep is similar."""
LAG_MARGIN = 0.02
"""Margin by which the correlation with a lag must exceed the one without."""
MAX_PIECE, MIN_PIECE = Fraction(10), Fraction(4)
MAX_SIMULATED_TIME = Fraction(24)
"""Longest and shortest piece, and total time, that is simulated [s]."""


@dataclass(frozen=True)
class OutputAgreement:
    """The agreement of outputs: measured = gain * simulated(t - lag).

    The gain is that of fast or of slow motion, whichever is nearer to 1. `level` is the ratio of
    root mean squares in the second half.
    """

    recording: str
    channel: str
    gain: float
    lag: float
    correlation: float
    correlation_without_lag: float
    level: float = 1.0

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

    Pieces are the most excited ones of 4 to 10 s, `MAX_SIMULATED_TIME` (24 s) in all. Inputs faster
    than 100 Hz are thinned out.
    """
    agreements: list[OutputAgreement] = []
    remaining_time = MAX_SIMULATED_TIME
    piece_length = min(MAX_PIECE, max(MIN_PIECE, MAX_SIMULATED_TIME / max(1, len(recordings))))
    for recording in recordings:
        for piece in split_by_windows(recording):
            if remaining_time <= 0:
                return agreements
            part = _decimate_inputs(most_excited_piece(piece, piece_length))
            remaining_time -= part.end - part.start
            for name, compared in reference.simulate(part).comparisons.items():
                agreement = compare_signals(part.name, name, compared)
                if agreement:
                    agreements.append(agreement)
    return agreements


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


def _decimate_inputs(piece: Recording) -> Recording:
    """Return a recording with every n-th sample of its inputs, at about 100 Hz."""
    channels = dict(piece.channels)
    for name, channel in piece.channels.items():
        span = channel.times[-1] - channel.times[0]
        every = int(len(channel.times) / (span / Fraction(GRID_STEP))) if span else 1
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
    """Return the rate of change after Gaussian smoothing, on the inner part of the grid."""
    width = _kernel_size(spread) // 2
    kernel = np.exp(-0.5 * (np.arange(-width, width + 1) * GRID_STEP / spread) ** 2)
    even = np.interp(grid, times, values)
    smooth = np.convolve(even, kernel / kernel.sum(), mode="valid")
    return np.gradient(smooth, GRID_STEP)


def _kernel_size(spread: float) -> int:
    """Return the number of samples of the Gaussian kernel, 4 standard deviations to both sides."""
    return 2 * math.ceil(4.0 * spread / GRID_STEP) + 1


def compare_signals(
    recording: str, name: str, comparison: OutputComparison, spread: float = SMOOTHING_STD
) -> OutputAgreement | None:
    """Return the agreement of the rates of change of two signals, smoothed by `spread` [s].

    The gain is negative if the reversed signal correlates better by `REVERSAL_MARGIN`. The result
    is None if less than 1 s remains, the simulation is not finite, or a rate is constant.
    """
    if len(comparison.times) < 2:
        return None
    start, end = comparison.times[0] + TRANSIENT_TIME, comparison.times[-1]
    if end - start < 1.0 or not np.all(np.isfinite(comparison.simulated)):
        return None
    grid = np.arange(start, end, GRID_STEP)
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
    late = comparison.times > 0.5 * (start + end)
    level = rms(comparison.measured[late]) / max(rms(comparison.simulated[late]), 1e-12)
    both = correlations[best], correlations[0]
    return OutputAgreement(recording, name, gain, best * GRID_STEP, *both, level)


def _low_frequency_rates(
    comparison: OutputComparison, grid: Reals, lag: int
) -> list[tuple[Reals, Reals]]:
    """Return a list with both rates below the resonances at a lag; empty if too short."""
    shifted = grid + lag * GRID_STEP
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
