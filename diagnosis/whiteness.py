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

from diagnosis.estimate import Estimate

Reals = NDArray[np.float64]
LONGEST = 0.25
"""Longest lag looked at [s]."""
MOST_LAGS = 60
BAND = 2.576
"""Standard deviations beyond which one lag in a hundred lies by accident."""
LITTLE = 0.05
"""Part of the variance told by the past that is too small to matter, whatever the test says."""
LEVEL = 0.01
"""Chance of the test to call white noise coloured."""


@dataclass(frozen=True)
class Whiteness:
    """Of one signal: `correlations` at `lags` [s] (lags,), and the `band` for 99 % of them.

    `chance` is that of white noise to hang together as much (Ljung, Box), `foretold` the part of
    the variance that its own past tells, `rms` the size [SI] of what is missed.
    """

    signal: str
    lags: Reals = field(repr=False)
    correlations: Reals = field(repr=False)
    band: float
    chance: float
    foretold: float
    rms: float

    @property
    def is_white(self) -> bool:
        """Tell whether the test has nothing to object."""
        return self.chance >= LEVEL

    @property
    def words(self) -> str:
        """The answer in words."""
        if self.is_white:
            return "white"
        return "nearly white" if self.foretold < LITTLE else "coloured"

    @property
    def outside(self) -> int:
        """The number of lags beyond the band."""
        return int(np.sum(np.abs(self.correlations) > self.band))


def whiteness_of(model: Estimate, period: float) -> list[Whiteness]:
    """Return for each compared signal how white the innovations of a model are; `period` [s]."""
    outcome = model.outcome
    names = model.candidate.predictor.seen
    found = []
    for channel, name in enumerate(names):
        limit = outcome.limits[channel]
        parts = [np.clip(e[:, channel], -limit, limit) for e in outcome.innovations]
        found.append(whiteness(name, parts, period))
    return found


def whiteness(name: str, parts: Sequence[Reals], period: float) -> Whiteness:
    """Return how white the pieces of a signal are, NaN where nothing is known; `period` [s]."""
    shortest = min(len(part) for part in parts)
    count = max(1, min(MOST_LAGS, round(LONGEST / period), shortest // 4))
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
    band = BAND / float(np.sqrt(np.median(pairs)))
    chance = float(chi2.sf(q, count))
    return Whiteness(
        name,
        lags * period,
        r,
        band,
        chance,
        _foretold(r * pairs / max(total, 1)),
        float(np.sqrt(power)),
    )


def _foretold(r: Reals) -> float:
    """Return the part of the variance that a linear prediction from the past tells.

    `r` are sums over all pairs by the number of all values: such a matrix is never indefinite.
    """
    weights = solve_toeplitz(np.concatenate([[1.0], r[:-1]]), r)
    return float(np.clip(weights @ r, 0.0, 1.0))
