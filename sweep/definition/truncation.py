"""Truncation: compute the quantile levels at the bounds of a truncated distribution."""

from __future__ import annotations

import numpy as np

from sweep.definition.study import Distribution


def truncation_levels(distribution: Distribution) -> tuple[float, float]:
    """Return the cumulative probabilities of a normal or lognormal at the ends of `within`.

    `within` must not be None; a bound of a lognormal below 1e-300 counts as 1e-300.
    """
    from scipy.special import ndtr

    assert distribution.within
    is_log = distribution.shape == "lognormal"
    first, second = distribution.numbers
    ends = (
        np.log(np.maximum(distribution.within, 1e-300))
        if is_log
        else np.asarray(distribution.within)
    )
    low, high = ndtr((ends - (np.log(first) if is_log else first)) / second)
    return float(low), float(high)
