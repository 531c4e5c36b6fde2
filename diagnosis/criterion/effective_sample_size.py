"""Effective sample size: the integrated autocorrelation of innovations (Bartlett 1946).

The number of samples divided by it is the effective number of independent samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate

MAX_LAG = 1.25
"""Longest lag, in reference times of the recordings."""


def integrated_autocorrelation(model: Estimate, series: Sequence[SampledRecording]) -> float:
    """Return 1 + 2 times the sum of squared autocorrelations up to `MAX_LAG`, the mean over
    outputs.

    Squared autocorrelations apply to quadratic functions such as log-likelihoods (Bartlett 1946).
    """
    lags = round(float(np.median([one.sample_count(MAX_LAG) for one in series])))
    return autocorrelation_sum(model.prediction.innovations, lags)


def autocorrelation_sum(signals: Sequence[Reals], lags: int) -> float:
    """Return 1 + 2 times the sum of squared autocorrelations up to `lags`, the mean over columns.

    `signals` (samples, columns) have one array per recording; unknown values are dropped.
    """
    by_output = []
    for channel in range(signals[0].shape[1]):
        by_recording = [e[np.isfinite(e[:, channel]), channel] for e in signals]
        power = sum(float(e @ e) for e in by_recording)
        total = 1.0
        for lag in range(1, lags + 1) if power > 0.0 else ():
            autocovariance = sum(float(e[lag:] @ e[:-lag]) for e in by_recording if len(e) > lag)
            total += 2.0 * (autocovariance / power) ** 2
        by_output.append(total)
    return float(np.mean(by_output))
