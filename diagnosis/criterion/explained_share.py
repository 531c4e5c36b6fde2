"""Explained share: the part of an unexplained energy that an effect explains (docs/method.md).

All models of a comparison predict the same recordings and contain the same ordinary disturbance, so
their mean-square innovations can be compared channel by channel.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.estimation.estimate import Estimate

FORM_ERROR = 0.3
"""Error of the form of an effect: standard deviation relative to the rms of the effect."""
FORM_SAMPLES = 16.0
"""Number of independent errors of the form of an effect (its degrees of freedom)."""
NEGLIGIBLE_ENERGY = 0.02
"""Energy of the remainder per channel below which no effect is sought: 2 % of the variance that
nothing explains."""
MAX_ORDINARY_ENERGY = 1.0
"""Energy of the remainder per channel up to which it may be an ordinary disturbance."""


def least_variances(models: Iterable[Estimate]) -> Reals:
    """Return the least mean-square innovation of each channel (channels,) over models.

    Models with an infinite cost are left out. At least one model must have a finite cost.
    """
    finite = [one.prediction.variances for one in models if np.isfinite(one.cost)]
    return np.asarray(np.min(finite, axis=0), dtype=np.float64)


def remaining_energy(model: Estimate, floor: Reals) -> float:
    """Return the energy that a model leaves, the sum over channels of v / floor - 1.

    `floor` (channels,) are the least mean-square innovations that any model of the comparison
    leaves. The energy is infinite for a model with infinite cost.
    """
    if not np.isfinite(model.cost):
        return math.inf
    return float(np.sum(model.prediction.variances / floor - 1.0))


def is_ordinary(energy: float, channels: int) -> bool:
    """Return whether a remaining energy may be that of an ordinary disturbance."""
    return energy <= MAX_ORDINARY_ENERGY * channels


def explained_share(model: Estimate, base: Estimate, floor: Reals) -> float:
    """Return the part of the remaining energy of `base` that `model` explains, 1 at most.

    It is 0 if the base leaves nothing, and negative for a model that leaves more than the base.
    """
    whole = remaining_energy(base, floor)
    return 1.0 - remaining_energy(model, floor) / whole if whole > 0.0 else 0.0


def least_share(total_gain: float = math.inf) -> float:
    """Return the explained share from which an effect is more probable than an unknown disturbance.

    It is where both have the same `log_form_weight`: 0.69 without noise, and less for a small
    `total_gain` [nats] of the best model over the base.
    """
    noise = FORM_SAMPLES / (2.0 * max(total_gain, 1.0))
    variance = FORM_ERROR**2 + noise
    return 1.0 - variance * (1.0 + math.log((1.0 + noise) / variance)) + noise


MIN_SHARE = least_share()
"""Explained share from which an effect is more probable than an unknown disturbance (0.69)."""


def log_form_weight(remaining: float | None, total_gain: float, parameters: int = 0) -> float:
    """Return the logarithm of the posterior mass of an effect that leaves a part of the energy.

    The errors of the form are `FORM_SAMPLES` (16) normal variables of variance `FORM_ERROR`^2
    relative to the effect, plus that of the noise, FORM_SAMPLES / (2 total_gain). `total_gain`
    [nats] is the gain of the best model over the base. None for `remaining` gives the weight of an
    unknown disturbance, whose variance is the one that fits best. Each of the `parameters` of the
    effect costs log(FORM_SAMPLES) / 2.
    """
    noise = FORM_SAMPLES / (2.0 * max(total_gain, 1.0))
    variance = FORM_ERROR**2 + noise
    if remaining is None:
        variance, remaining = 1.0 + noise, 1.0
    misfit = math.log(variance) + (max(remaining, 0.0) + noise) / variance
    return -FORM_SAMPLES / 2.0 * misfit - parameters / 2.0 * math.log(FORM_SAMPLES)
