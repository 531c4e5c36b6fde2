"""Explained share: the part of an unexplained energy that an effect explains (docs/method.md).

All models of a comparison predict the same recordings and contain the same ordinary disturbance, so
their mean-square innovations can be compared channel by channel.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from scipy.optimize import brentq

from diagnosis.data.array_types import Reals
from diagnosis.estimation.estimate import Estimate

LEAST_FORM_ERROR = 0.02
"""Least error of the form of an effect: standard deviation relative to the rms of the effect."""
FORM_ERROR = 0.4
"""Largest error of the form of an effect; its logarithm is uniform."""
USUAL_FORM_ERROR: float = FORM_ERROR**0.9 * LEAST_FORM_ERROR ** (1 - 0.9)
"""Error of the form that 9 of 10 effects do not exceed (0.30)."""
FORM_SAMPLES = 8.0
"""Number of independent errors of the form of an effect (its degrees of freedom)."""
NEGLIGIBLE_ENERGY = 0.012
"""Energy per channel that the errors of form of a base may leave: 1.2 % of the variance that
nothing explains. A model that explains no more is no effect."""
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


def sampled_energy(base: Estimate, floor: Reals, correlation: float) -> float:
    """Return the energy that a base leaves, each channel times its number of independent samples.

    `correlation` is the number of samples that count as one.
    """
    excess = np.maximum(base.prediction.variances / floor - 1.0, 0.0)
    return float(np.sum(base.prediction.counts * excess)) / correlation


def negligible_gain(samples: float) -> float:
    """Return the gain [nats] of a model that explains a negligible energy in independent samples.

    `samples` is their number over all channels.
    """
    return NEGLIGIBLE_ENERGY * samples / 2.0


def least_share(energy: float = math.inf, parameters: int = 1) -> float:
    """Return the explained share from which an effect is more probable than an unknown disturbance.

    It is where both have the same `log_form_weight`: 0.69 without noise for one parameter, less for
    a small `sampled_energy`, more for an effect with more `parameters`; infinite if no share is
    enough.
    """
    unknown = log_form_weight(None, energy)

    def advantage(remaining: float) -> float:
        return log_form_weight(remaining, energy, parameters) - unknown

    if advantage(0.0) < 0.0:
        return math.inf
    return 1.0 - float(brentq(advantage, 0.0, 1.0)) if advantage(1.0) < 0.0 else 0.0


def log_form_weight(remaining: float | None, energy: float, parameters: int = 0) -> float:
    """Return the logarithm of the posterior mass of an effect that leaves a part of the energy.

    The errors of the form are `FORM_SAMPLES` (8) normal variables. Their standard deviation,
    relative to the effect, has a uniform logarithm from `LEAST_FORM_ERROR` (0.02) to `FORM_ERROR`
    (0.4). The noise adds FORM_SAMPLES / energy to their variance; `energy` is the `sampled_energy`
    of the base. None for `remaining` gives the weight of an unknown disturbance, whose variance is
    the one that fits best. Each of the `parameters` of the effect, and this variance, costs
    log(FORM_SAMPLES) / 2.
    """
    noise = FORM_SAMPLES / max(energy, 1.0)
    price = math.log(FORM_SAMPLES) / 2.0
    if remaining is None:
        return -FORM_SAMPLES / 2.0 * (math.log(1.0 + noise) + 1.0) - price
    ends = np.geomspace(LEAST_FORM_ERROR, FORM_ERROR)
    variances = ends[1:] * ends[:-1] + noise
    misfits = np.log(variances) + (max(remaining, 0.0) + noise) / variances
    mass = float(np.logaddexp.reduce(-FORM_SAMPLES / 2.0 * misfits)) - math.log(len(variances))
    return mass - parameters * price


MIN_SHARE = least_share()
"""Explained share from which an effect is more probable than an unknown disturbance (0.69)."""
