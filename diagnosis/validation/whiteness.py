"""Whiteness: the autocorrelation of the innovations of a model (Ljung, Box 1978)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.stats import chi2

from diagnosis.data.array_types import Reals
from diagnosis.estimation.estimate import Estimate

MAX_LAGS = 50
"""Longest lag [samples]."""
BAND_STDS = 2.576
"""Standard deviations of the 99 % band."""
NEGLIGIBLE_FRACTION = 0.05
"""Predictable fraction of the variance that is negligible, whatever the test says."""
SIGNIFICANCE_LEVEL = 0.01
"""Probability with which the test rejects white noise."""


@dataclass(frozen=True)
class WhitenessTest:
    """Autocorrelations at `lags` [s] with their 99 % band, and the Ljung-Box test of a signal.

    `predictable_fraction` is the variance that a linear predictor explains; `rms` is in SI.
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
        """Whether `p_value` is at least `SIGNIFICANCE_LEVEL` (0.01)."""
        return self.p_value >= SIGNIFICANCE_LEVEL

    @property
    def rating(self) -> str:
        """`white`, else `nearly white` below `NEGLIGIBLE_FRACTION` (0.05), else `coloured`."""
        if self.is_white:
            return "white"
        return "nearly white" if self.predictable_fraction < NEGLIGIBLE_FRACTION else "coloured"

    @property
    def lags_outside_band(self) -> int:
        """The number of lags whose |correlation| exceeds the 99 % band."""
        return int(np.sum(np.abs(self.correlations) > self.band))


def innovation_whiteness(model: Estimate, period: float) -> list[WhitenessTest]:
    """Return the test of each output's innovations after burn-in; `period` in s."""
    prediction = model.prediction
    names = model.candidate.predictor.outputs
    found = []
    for channel, name in enumerate(names):
        limit = prediction.huber_limits[channel]
        parts = [np.clip(e[:, channel], -limit, limit) for e in prediction.innovations]
        found.append(ljung_box(name, parts, period))
    return found


def ljung_box(name: str, parts: Sequence[Reals], period: float) -> WhitenessTest:
    """Return the test of a signal given in parts, NaN where unknown; `period` [s].

    The sum over lags of pairs times squared autocorrelation (mean not subtracted) is chi-squared.
    The lags reach to `MAX_LAGS` (50) or a quarter of the shortest part, but there is one at least.
    """
    shortest = min(len(part) for part in parts)
    count = max(1, min(MAX_LAGS, shortest // 4))
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
    p_value = float(chi2.sf(q, count))
    return WhitenessTest(
        name,
        lags * period,
        r,
        band,
        p_value,
        _predictable_fraction(r * pairs / max(total, 1)),
        float(np.sqrt(power)),
    )


def _predictable_fraction(r: Reals) -> float:
    """Return the variance that Yule-Walker explains for biased autocorrelations `r` (lags,)."""
    weights = solve_toeplitz(np.concatenate([[1.0], r[:-1]]), r)
    return float(np.clip(weights @ r, 0.0, 1.0))
