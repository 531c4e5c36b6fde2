"""Whiteness: whether what a model misses from sample to sample still hangs together.

Where it does, something that was recorded is not in the model (Ljung, Box 1978).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz
from scipy.stats import chi2

from diagnosis.estimation.estimate import Estimate

Reals = NDArray[np.float64]
MAX_LAG_TIME = 0.25
"""Longest lag looked at [s]."""
MAX_LAGS = 60
BAND_STDS = 2.576
"""Standard deviations beyond which one lag in a hundred lies by accident."""
NEGLIGIBLE_FRACTION = 0.05
"""Part of the variance told by the past that is too small to matter, whatever the test says."""
SIGNIFICANCE_LEVEL = 0.01
"""Chance of the test to call white noise coloured."""


@dataclass(frozen=True)
class WhitenessTest:
    """Of one signal: `correlations` at `lags` [s] (lags,), and the `band` for 99 % of them.

    `chance` is that of white noise to hang together as much (Ljung, Box), `foretold` the part of
    the variance that its own past tells, `rms` the size [SI] of what is missed.
    """

    signal: str
    lags: Reals = field(repr=False)
    correlations: Reals = field(repr=False)
    band: float
    p_value: float
    predictable_fraction: float
    rms: float

    @property
    def is_white(self) -> bool:
        """Tell whether the test has nothing to object."""
        return self.p_value >= SIGNIFICANCE_LEVEL

    @property
    def rating(self) -> str:
        """The answer in words."""
        if self.is_white:
            return "white"
        return "nearly white" if self.predictable_fraction < NEGLIGIBLE_FRACTION else "coloured"

    @property
    def lags_outside_band(self) -> int:
        """The number of lags beyond the band."""
        return int(np.sum(np.abs(self.correlations) > self.band))


def innovation_whiteness(model: Estimate, period: float) -> list[WhitenessTest]:
    """Return for each compared signal how white the innovations of a model are; `period` [s]."""
    prediction = model.prediction
    names = model.candidate.predictor.outputs
    found = []
    for channel, name in enumerate(names):
        limit = prediction.huber_limits[channel]
        parts = [np.clip(e[:, channel], -limit, limit) for e in prediction.innovations]
        found.append(ljung_box(name, parts, period))
    return found


def ljung_box(name: str, parts: Sequence[Reals], period: float) -> WhitenessTest:
    """Return how white the pieces of a signal are, NaN where nothing is known; `period` [s]."""
    shortest = min(len(part) for part in parts)
    count = max(1, min(MAX_LAGS, round(MAX_LAG_TIME / period), shortest // 4))
    total = sum(int(np.sum(np.isfinite(part))) for part in parts)
    power = sum(float(np.nansum(part**2)) for part in parts) / max(total, 1)
    lags = np.arange(1.0, count + 1.0)
    r, pairs = np.zeros(count), np.ones(count)
    for k in range(1, count + 1):
        products = np.concatenate([part[k:] * part[:-k] for part in parts])
        known = products[np.isfinite(products)]
        pairs[k - 1] = max(len(known), 1)
        r[k - 1] = float(np.sum(known)) / pairs[k - 1] / max(power, 1e-300)
    q = float(np.sum(pairs * r**2))
    band = BAND_STDS / float(np.sqrt(np.median(pairs)))
    chance = float(chi2.sf(q, count))
    return WhitenessTest(
        name,
        lags * period,
        r,
        band,
        chance,
        _predictable_fraction(r * pairs / max(total, 1)),
        float(np.sqrt(power)),
    )


def _predictable_fraction(r: Reals) -> float:
    """Return the part of the variance that a linear prediction from the past tells.

    `r` are sums over all pairs by the number of all values: such a matrix is never indefinite.
    """
    weights = solve_toeplitz(np.concatenate([[1.0], r[:-1]]), r)
    return float(np.clip(weights @ r, 0.0, 1.0))
