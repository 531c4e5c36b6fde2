"""Parameter covariance: covariance, standard deviations and correlations of a fit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.normal_equations import solve
from diagnosis.estimation.quantity import Quantity


def quantities_of(model: Estimate) -> dict[str, Quantity]:
    """Return the value [SI] and standard deviation of each free parameter, by name.

    A parameter per recording has the mean of its values, and the standard deviation of an average
    recording with the shared parameters fixed. That of a logarithmic coordinate is scaled to the
    value. The model must have normal equations.
    """
    spread = _coordinate_stds(model)
    recordings = len(model.point.per_recording)
    each = [model.values(k) for k in range(recordings)]
    quantities = {}
    for k, one in enumerate(model.candidate.free_parameters):
        value = float(np.mean([values[one.name] for values in each]))
        slope = one.prior_std * (value if one.is_log else 1.0)
        quantities[one.name] = Quantity(value, one.unit, abs(slope) * float(spread[k]))
    return quantities


def correlations_of(model: Estimate) -> Mapping[tuple[str, str], float]:
    """Return the correlations of all pairs of shared parameters, largest magnitude first.

    The key is (name, name) in the order of the candidate. Parameters per recording are left out.
    The model must have normal equations.
    """
    covariance, names = covariance_of(model)
    sizes = np.sqrt(np.diag(covariance))
    correlations = {}
    for i, first in enumerate(names):
        for j in range(i):
            correlations[names[j], first] = float(covariance[i, j] / (sizes[i] * sizes[j]))
    return dict(sorted(correlations.items(), key=lambda item: -abs(item[1])))


def covariance_of(model: Estimate) -> tuple[Reals, list[str]]:
    """Return the posterior covariance (n, n) of the shared coordinates, and their names.

    It is the inverse of J'WJ + I, where I comes from the standard normal priors. Coordinates per
    recording are left out, as if they were fixed. The model must have normal equations.
    """
    assert model.normal_equations is not None
    free = ~model.normal_equations.own
    whole = np.sum(model.normal_equations.a, axis=0)[np.ix_(free, free)] + np.eye(int(free.sum()))
    names = [name for name, one in zip(model.candidate.names, free, strict=True) if one]
    return solve(whole, np.eye(len(whole))), names


def _coordinate_stds(model: Estimate) -> Reals:
    """Return the standard deviations of all coordinates (parameters,).

    A coordinate per recording has the one of an average recording, with shared parameters fixed.
    """
    assert model.normal_equations is not None
    covariance, _ = covariance_of(model)
    own = model.normal_equations.own
    stds = np.zeros(len(own))
    stds[~own] = np.sqrt(np.diag(covariance))
    for k in np.flatnonzero(own):
        stds[k] = 1.0 / np.sqrt(1.0 + float(np.mean(model.normal_equations.a[:, k, k])))
    return stds
