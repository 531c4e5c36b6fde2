"""Consistency: how recorded outputs move with those simulated under the recorded inputs.

Compared are smoothed rates of change: wrong loads and start values, which drift, matter little.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from diagnosis.free_run import Compared
from diagnosis.reference import Reference
from engine.recording import Channel, Recording, cut, pieces

Values = NDArray[np.float64]

GRID = 0.01
"""Step of the grid on which rates of change are compared [s]."""
SMOOTH = 0.04
"""Standard deviation of the smoothing [s]: what is left is below about 4 Hz."""
SMOOTH_GAIN = 0.15
"""The same for gains, which resonances shall not change: below about 1 Hz."""
LARGEST_LAG = 1.0
"""Largest offset of clocks looked for [s]."""
SETTLED = 0.8
"""Time after the start that is left out: start values are not those of the recording [s]."""
ALIKE = 0.75
"""Correlation from which two signals are taken for the same motion."""
CLEARLY_AGAINST = 0.15
"""How much better the reversed signal has to fit: half a period of a sweep looks alike."""
CLEARER = 0.02
"""How much better than without a lag the correlation has to be, to believe in the lag."""
LONGEST_PIECE, SHORTEST_PIECE = Fraction(10), Fraction(4)
MOST_SIMULATED = Fraction(24)
"""Longest and shortest piece, and longest time of all, that is simulated for this [s]."""


@dataclass(frozen=True)
class Relation:
    """How a measured output goes with the simulated one: measured = gain * simulated(t - lag).

    Of the gain of fast and of slow motion that is taken which is nearer to 1. `level` is how large
    it is against the simulated one once both have found to each other.
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
        """Tell whether both are the same motion."""
        return abs(self.correlation) >= ALIKE

    @property
    def improvement(self) -> float:
        """How much better the correlation is with the lag."""
        return abs(self.correlation) - abs(self.correlation_without_lag)

    @property
    def believed_lag(self) -> float:
        """The lag [s], 0 where no lag would do as well."""
        return self.lag if self.is_clear and self.improvement > CLEARER else 0.0


def relations(recordings: Sequence[Recording], reference: Reference) -> list[Relation]:
    """Return how the outputs of each piece go with a simulation under the recorded inputs."""
    found: list[Relation] = []
    left = MOST_SIMULATED
    each = min(LONGEST_PIECE, max(SHORTEST_PIECE, MOST_SIMULATED / max(1, len(recordings))))
    for recording in recordings:
        for piece in pieces(recording):
            if left <= 0:
                return found
            part = _thinned(lively(piece, each))
            left -= part.end - part.start
            for name, compared in reference.run(part).compared.items():
                relation = relation_of(part.name, name, compared)
                if relation:
                    found.append(relation)
    return found


def lively(piece: Recording, longest: Fraction) -> Recording:
    """Return the most lively stretch of a piece that is no longer than `longest`."""
    if piece.end - piece.start <= longest:
        return piece
    count = int(2 * (piece.end - piece.start) / longest)
    starts = [piece.start + k * longest / 2 for k in range(count)]
    best = max(starts, key=lambda start: _liveliness(piece, start, start + longest))
    return cut(piece, (best, min(piece.end, best + longest)))


def _thinned(piece: Recording) -> Recording:
    """Return a recording with every n-th sample of its inputs: 100 Hz are enough for this."""
    channels = dict(piece.channels)
    for name, channel in piece.channels.items():
        span = channel.times[-1] - channel.times[0]
        every = int(len(channel.times) / (span / Fraction(GRID))) if span else 1
        if channel.column.to is not None and every > 1:
            channels[name] = Channel(
                channel.column, channel.times[::every], channel.values[::every]
            )
    return dataclasses.replace(piece, channels=channels)


def _liveliness(piece: Recording, start: Fraction, end: Fraction) -> float:
    total = 0.0
    for channel in piece.channels.values():
        inside = (channel.seconds >= float(start)) & (channel.seconds <= float(end))
        spread = float(np.std(channel.array)) or 1.0
        if inside.sum() > 2 and channel.column.to is not None:
            total += float(np.std(np.diff(channel.array[inside]))) / spread
    return total


def _rate(times: Values, values: Values, grid: Values, spread: float = SMOOTH) -> Values:
    """Return the smoothed rate of change on a grid."""
    width = _kernel_size(spread) // 2
    kernel = np.exp(-0.5 * (np.arange(-width, width + 1) * GRID / spread) ** 2)
    even = np.interp(grid, times, values)
    smooth = np.convolve(even, kernel / kernel.sum(), mode="valid")
    return np.gradient(smooth, GRID)


def _kernel_size(spread: float) -> int:
    """Return how many samples of a grid one smoothed value is made of."""
    return 2 * math.ceil(4.0 * spread / GRID) + 1


def relation_of(
    recording: str, name: str, compared: Compared, spread: float = SMOOTH
) -> Relation | None:
    """Return how two signals, smoothed by `spread` [s], go together; None for too short ones."""
    start, end = compared.times[0] + SETTLED, compared.times[-1]
    if end - start < 1.0 or not np.all(np.isfinite(compared.simulated)):
        return None
    grid = np.arange(start, end, GRID)
    measured = _rate(compared.times, compared.measured, grid, spread)
    simulated = _rate(compared.times, compared.simulated, grid, spread)
    most = min(round(LARGEST_LAG / GRID), len(grid) // 4)
    if len(measured) < 3 * most or not measured.std() or not simulated.std():
        return None
    lags = range(-most, most + 1)
    pairs = {lag: _overlap(measured, simulated, lag) for lag in lags}
    correlations = {lag: _correlation(*pair) for lag, pair in pairs.items()}
    best = max(lags, key=lambda lag: correlations[lag])
    against = min(lags, key=lambda lag: correlations[lag])
    if -correlations[against] > correlations[best] + CLEARLY_AGAINST:
        best = against
    gains = [_ratio(pair) for pair in (pairs[best], *_slow(compared, grid, best))]
    gain = math.copysign(min(gains, key=lambda g: abs(math.log(g))), correlations[best])
    late = compared.times > 0.5 * (start + end)
    level = _size(compared.measured[late]) / max(_size(compared.simulated[late]), 1e-12)
    both = correlations[best], correlations[0]
    return Relation(recording, name, gain, best * GRID, *both, level)


def _slow(compared: Compared, grid: Values, lag: int) -> list[tuple[Values, Values]]:
    """Return both rates below the resonances, or nothing where that takes more than there is.

    A fast sweep has little there but drift.
    """
    shifted = grid + lag * GRID
    kept = (shifted >= grid[0]) & (shifted <= grid[-1])
    if np.count_nonzero(kept) <= _kernel_size(SMOOTH_GAIN):
        return []
    y = _rate(compared.times, compared.measured, shifted[kept], SMOOTH_GAIN)
    return [(y, _rate(compared.times, compared.simulated, grid[kept], SMOOTH_GAIN))]


def _ratio(pair: tuple[Values, Values]) -> float:
    """Return the ratio of the spreads, held within what any mistake of units makes."""
    return min(max(float(np.std(pair[0])) / max(float(np.std(pair[1])), 1e-12), 1e-6), 1e6)


def _size(values: Values) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _overlap(measured: Values, simulated: Values, lag: int) -> tuple[Values, Values]:
    if lag >= 0:
        return measured[lag:], simulated[: len(simulated) - lag]
    return measured[:lag], simulated[-lag:]


def _correlation(y: Values, x: Values) -> float:
    y, x = y - y.mean(), x - x.mean()
    size = float(np.sqrt((y @ y) * (x @ x)))
    return float(y @ x) / size if size else 0.0
