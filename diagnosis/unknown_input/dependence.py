"""Input dependence: whether a disturbance is large while known inputs vary, or near standstill.

An unknown input is independent of known ones. Errors of an actuator, a shaft or a tyre appear when
known inputs change, and errors of friction near standstill; these are no inputs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples

WINDOW_TIMES = (1.5, 5.0)
"""Reference times in which an input has its response: at once, or as long as a limit acts."""
SMOOTHING_TIME = 0.25
"""Reference times over which an input is averaged before its rate is taken: it has noise."""
STANDSTILL_STDS = 0.1
"""Standard deviations of a signal within which it is near rest."""


def input_dependence(series: Sequence[SampledRecording], disturbances: Sequence[Reals]) -> float:
    """Return the largest correlation of an amplitude with an input's rate or amplitude."""
    pairs = list(zip(series, disturbances, strict=True))
    columns = range(series[0].inputs.shape[1])
    return max(
        (
            _amplitude_correlation(
                series, disturbances, [found(one, k, len(u)) for one, u in pairs], within
            )
            for k in columns
            for found in (_input_rate, _input_amplitude)
            for within in WINDOW_TIMES
        ),
        default=0.0,
    )


def standstill_dependence(
    series: Sequence[SampledRecording], disturbances: Sequence[Reals]
) -> float:
    """Return the largest correlation of an amplitude with an output near standstill."""
    most = 0.0
    for column in range(series[0].measured.shape[1]):
        spread = np.nanstd(np.concatenate([one.measured[:, column] for one in series]))
        near = [
            _nearness_to_standstill(one, column, len(u), STANDSTILL_STDS * float(spread))
            for one, u in zip(series, disturbances, strict=True)
        ]
        most = max(most, _amplitude_correlation(series, disturbances, near, WINDOW_TIMES[0]))
    return most


def _amplitude_correlation(
    series: Sequence[SampledRecording],
    disturbances: Sequence[Reals],
    features: Sequence[Reals],
    window: float,
) -> float:
    """Return the correlation of moving means of an amplitude and a feature, 0 if constant."""
    loud = [
        _moving_mean(np.abs(u), one, window) for u, one in zip(disturbances, series, strict=True)
    ]
    near = [_moving_mean(values, one, window) for values, one in zip(features, series, strict=True)]
    whole, along = np.concatenate(loud), np.concatenate(near)
    if np.std(along) > 0.0 and np.std(whole) > 0.0:
        return float(np.corrcoef(whole, along)[0, 1])
    return 0.0


def _nearness_to_standstill(
    series: SampledRecording, column: int, count: int, width: float
) -> Reals:
    """Return 1 where a compared signal is at rest, 0 far from it (count,)."""
    values = series.measured[burn_in_samples(series) : burn_in_samples(series) + count, column]
    near = np.exp(-((np.nan_to_num(values, nan=np.inf) / max(width, 1e-300)) ** 2))
    return np.asarray(near, dtype=np.float64)


def _input_rate(series: SampledRecording, column: int, count: int) -> Reals:
    """Return how much an input moves at each sample (count,)."""
    values = series.inputs[burn_in_samples(series) : burn_in_samples(series) + count, column]
    even = _moving_mean(values, series, SMOOTHING_TIME)
    return np.asarray(np.abs(np.diff(even, prepend=even[:1])), dtype=np.float64)


def _input_amplitude(series: SampledRecording, column: int, count: int) -> Reals:
    """Return how large an input is at each sample (count,)."""
    values = series.inputs[burn_in_samples(series) : burn_in_samples(series) + count, column]
    return np.asarray(np.abs(values), dtype=np.float64)


def _moving_mean(values: Reals, series: SampledRecording, window: float) -> Reals:
    """Return means over a window [reference times] around each sample."""
    count = max(3, series.sample_count(window))
    padded = np.pad(values, (count // 2, count - 1 - count // 2), mode="edge")
    return np.asarray(np.convolve(padded, np.full(count, 1.0 / count), "valid"), dtype=np.float64)
