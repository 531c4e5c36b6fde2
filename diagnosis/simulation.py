"""Simulation: how far a model goes astray when nothing corrects it, before and after.

An observer runs for a second, then the model is alone for one and a half: the difference to what
was recorded there, over the spread of the recorded signal. A model that forgets where it started
is alone for the whole of each recording, once its states have been found.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate
from diagnosis.joined import burnt
from diagnosis.prediction import predicted
from diagnosis.series import Series
from diagnosis.verdict import Misfit

Reals = NDArray[np.float64]
OBSERVED = 1.0
"""Seconds in which the observer follows."""
FREE = 1.5
"""Seconds in which the model is alone."""


def misfits(before: Estimate, after: Estimate, series: Sequence[Series]) -> dict[str, Misfit]:
    """Return the misfit of each compared signal, of two models that are fitted to `series`."""
    first, second = nrmse(before, series), nrmse(after, series)
    names = before.candidate.predictor.seen
    return {
        name: Misfit(float(a), float(b), float(a * of), float(b * of))
        for name, a, b, of in zip(names, first, second, spread_of(series), strict=True)
    }


def nrmse(model: Estimate, series: Sequence[Series]) -> Reals:
    """Return the normalised root mean square of free simulation by signal (seen,)."""
    squares, counts = [], []
    for one, simulated in zip(series, free(model, series), strict=True):
        counted = is_later(one) if model.noises.is_alone else is_free(one)
        alone = counted[:, None] & np.isfinite(one.measured) & np.isfinite(simulated)
        error = np.where(alone, one.measured - simulated, 0.0)
        squares.append(np.sum(error**2, axis=0))
        counts.append(np.sum(alone, axis=0))
    mean = np.sum(squares, axis=0) / np.maximum(np.sum(counts, axis=0), 1)
    return np.asarray(np.sqrt(mean) / spread_of(series), dtype=np.float64)


def spread_of(series: Sequence[Series]) -> Reals:
    """Return the standard deviation of each compared signal [SI] (seen,)."""
    spread = np.nanstd(np.concatenate([one.measured for one in series]), axis=0)
    return np.asarray(np.maximum(spread, 1e-12), dtype=np.float64)


def free(model: Estimate, series: Sequence[Series]) -> list[Reals]:
    """Return what a model shows for each recording (samples, seen): followed, then alone."""
    hidden = [
        dataclasses.replace(one, measured=np.where(is_free(one)[:, None], np.nan, one.measured))
        for one in series
    ]
    values = [model.values(k) for k in range(len(series))]
    hidden = [
        dataclasses.replace(one, measured=np.ascontiguousarray(one.measured)) for one in hidden
    ]
    outcome = predicted(model.candidate, hidden, values, model.gains, model.noises.limits)
    return [p.seen for p in outcome.predictions]


def is_later(series: Series) -> NDArray[np.bool_]:
    """Return the samples (samples,) behind those in which the states are found."""
    return np.asarray(np.arange(series.count) >= burnt(series))


def is_free(series: Series) -> NDArray[np.bool_]:
    """Return the samples (samples,) at which the model is alone."""
    time = np.arange(series.count) * float(series.period)
    return np.asarray(np.mod(time, OBSERVED + FREE) >= OBSERVED)
