"""Parameter covariance: covariance, standard deviations and correlations of a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.normal_equations import solve
from diagnosis.estimation.quantity import Quantity

WINDOW = 5.0
"""Lags of an integrated autocorrelation, in its own value, after which its sum ends."""


def quantities_of(model: Estimate) -> dict[str, Quantity]:
    """Return the value [SI] and standard deviation of each free parameter, by name.

    The standard deviation of a shared parameter is that of `marginal_covariance`. A parameter per
    recording has the mean of its values, and the standard deviation of an average recording with
    the shared parameters fixed. The model must have normal equations and a Jacobian.
    """
    assert model.normal_equations is not None
    covariance, names = marginal_covariance(model)
    stds = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    each = [model.values(k) for k in range(len(model.point.per_recording))]
    quantities = {}
    for k, one in enumerate(model.candidate.free_parameters):
        value = float(np.mean([values[one.name] for values in each]))
        if one.name not in stds:
            information = float(np.mean(model.normal_equations.a[:, k, k]))
            slope = one.prior_std * (value if one.is_log else 1.0)
            stds[one.name] = abs(slope) / math.sqrt(1.0 + information)
        quantities[one.name] = Quantity(value, one.unit, stds[one.name])
    return quantities


def correlations_of(covariance: Reals, names: Sequence[str]) -> Mapping[tuple[str, str], float]:
    """Return the correlations of all pairs of parameters, largest magnitude first.

    `covariance` has the shape (n, n). The key is (name, name) in the order of `names`.
    """
    sizes = np.sqrt(np.diag(covariance))
    correlations = {}
    for i, first in enumerate(names):
        for j in range(i):
            correlations[names[j], first] = float(covariance[i, j] / (sizes[i] * sizes[j]))
    return dict(sorted(correlations.items(), key=lambda item: -abs(item[1])))


def coordinate_covariance(model: Estimate) -> tuple[Reals, list[str]]:
    """Return the covariance (n, n) of the coordinates of the shared parameters, and their names.

    Coordinates per recording are eliminated, so their uncertainty is included. Innovations count as
    independent. The model must have normal equations.
    """
    covariance, _ = _eliminate_per_recording(model)
    assert model.normal_equations is not None
    free = np.flatnonzero(~model.normal_equations.own)
    return covariance, [model.candidate.names[k] for k in free]


def _eliminate_per_recording(model: Estimate) -> tuple[Reals, list[Reals]]:
    """Return the covariance (n, n) of the shared coordinates, and the projections (own, n) on them
    of the coordinates of each recording.
    """
    normal = model.normal_equations
    assert normal is not None
    free, own = np.flatnonzero(~normal.own), np.flatnonzero(normal.own)
    information, projections = np.eye(len(free)), []
    for a in normal.a:
        inner = a[np.ix_(own, own)] + np.eye(len(own))
        projections.append(solve(inner, a[np.ix_(own, free)]))
        information = information + a[np.ix_(free, free)] - a[np.ix_(free, own)] @ projections[-1]
    return solve(information, np.eye(len(free))), projections


def marginal_covariance(model: Estimate) -> tuple[Reals, list[str]]:
    """Return the covariance (n, n) [SI] of the shared parameters, and their names.

    It is that of `coordinate_covariance`, in SI. Innovations of a model that lacks physics are
    correlated. The variance of a parameter is therefore at least the long-run variance of its
    influences (`long_run_variance`; Newey and West 1987). The model must have normal equations and
    a Jacobian.
    """
    covariance, projections = _eliminate_per_recording(model)
    assert model.normal_equations is not None
    own = np.flatnonzero(model.normal_equations.own)
    free = np.flatnonzero(~model.normal_equations.own)
    scores = _scores(model)
    influences = [
        (scores[rows][:, free] - scores[rows][:, own] @ projection) @ covariance
        for rows, projection in zip(model.prediction.slices, projections, strict=True)
    ]
    found = [long_run_variance([one[:, k] for one in influences]) for k in range(len(free))]
    ratios = np.maximum(np.array(found) / np.diag(covariance), 1.0)
    values, parameters = model.values(0), model.candidate.free_parameters
    slopes = [
        parameters[k].prior_std * (values[parameters[k].name] if parameters[k].is_log else 1.0)
        for k in free
    ]
    scale = np.array(slopes) * np.sqrt(ratios)
    return covariance * np.outer(scale, scale), [parameters[k].name for k in free]


def long_run_variance(series: Sequence[Reals]) -> float:
    """Return the variance of the sum of all values of zero-mean series, (samples,) each.

    It is the sum of squares times the integrated autocorrelation 1 + 2 sum of rho(k). The sum ends
    at the first lag that is at least `WINDOW` (5) times the integrated autocorrelation up to it, at
    least 1 (Sokal 1997, section 3), or at half of the longest series. Different series are
    independent.
    """
    power = sum(float(one @ one) for one in series)
    if power <= 0.0:
        return 0.0
    longest, total = max(len(one) for one in series), 1.0
    size = 2 * longest
    spectrum = sum(np.abs(np.fft.rfft(one, size)) ** 2 for one in series)
    correlations = np.fft.irfft(spectrum, size) / power
    for lag in range(1, longest // 2):
        total += 2.0 * float(correlations[lag])
        if lag >= WINDOW * max(total, 1.0):
            break
    return power * total


def _scores(model: Estimate) -> Reals:
    """Return the derivative of the log-likelihood at each sample (samples, coordinates)."""
    prediction, names = model.prediction, model.candidate.names
    innovation = prediction.stacked
    far = np.maximum(np.abs(innovation) / prediction.huber_limits, 1.0)
    weighted = np.where(np.isfinite(innovation), innovation / prediction.variances / far, 0.0)
    scores = np.empty((len(innovation), len(names)))
    for k, name in enumerate(names):
        scores[:, k] = -np.sum(np.nan_to_num(model.jacobian[name]) * weighted, axis=1)
    return scores
