"""Input dependence: whether a disturbance is large while known inputs vary, or near standstill.

Errors of an actuator, a shaft or a tyre appear when known inputs change, and errors of friction
near standstill; an unknown input is independent of both.
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
    correlations = []
    for k in range(series[0].inputs.shape[1]):
        inputs = _beside(series, [one.inputs[:, k] for one in series], disturbances)
        even = [_moving_mean(u, one, SMOOTHING_TIME) for u, one in zip(inputs, series, strict=True)]
        rates = [np.abs(np.diff(u, prepend=u[:1])) for u in even]
        for feature in (rates, [np.abs(u) for u in inputs]):
            for window in WINDOW_TIMES:
                correlations.append(_amplitude_correlation(series, disturbances, feature, window))
    return max(correlations, default=0.0)


def standstill_dependence(
    series: Sequence[SampledRecording], disturbances: Sequence[Reals]
) -> float:
    """Return the largest correlation of an amplitude with an output near standstill."""
    most = 0.0
    for k in range(series[0].measured.shape[1]):
        columns = [one.measured[:, k] for one in series]
        width = max(STANDSTILL_STDS * float(np.nanstd(np.concatenate(columns))), 1e-300)
        known = [np.nan_to_num(y, nan=np.inf) for y in _beside(series, columns, disturbances)]
        near = [np.exp(-((y / width) ** 2)) for y in known]
        most = max(most, _amplitude_correlation(series, disturbances, near, WINDOW_TIMES[0]))
    return most


def _beside(
    series: Sequence[SampledRecording], signals: Sequence[Reals], disturbances: Sequence[Reals]
) -> list[Reals]:
    """Return signals (samples,) where the disturbances of the recordings are known."""
    starts = [burn_in_samples(one) for one in series]
    parts = zip(signals, starts, disturbances, strict=True)
    return [signal[start : start + len(known)] for signal, start, known in parts]


def _amplitude_correlation(
    series: Sequence[SampledRecording],
    disturbances: Sequence[Reals],
    features: Sequence[Reals],
    window: float,
) -> float:
    """Return the correlation of moving means of an amplitude and a feature, 0 if constant."""
    whole, along = (
        np.concatenate([_moving_mean(u, r, window) for u, r in zip(signals, series, strict=True)])
        for signals in ([np.abs(u) for u in disturbances], features)
    )
    if np.std(along) > 0.0 and np.std(whole) > 0.0:
        return float(np.corrcoef(whole, along)[0, 1])
    return 0.0


def _moving_mean(values: Reals, series: SampledRecording, window: float) -> Reals:
    """Return means over a window [reference times] around each sample."""
    count = max(3, series.sample_count(window))
    padded = np.pad(values, (count // 2, count - 1 - count // 2), mode="edge")
    return np.asarray(np.convolve(padded, np.full(count, 1.0 / count), "valid"), dtype=np.float64)
