"""Cross-validation: squares on left-out blocks of recordings, by an infinitesimal jackknife.

Every fifth block in time of each recording is left out in turn (Efron 1982).
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, predict_with_gains_of
from diagnosis.estimation.innovations import FOLDS, PredictionResult
from diagnosis.estimation.normal_equations import damped_step
from diagnosis.model.parameter_vector import ParameterVector

STEP_FRACTIONS = (1.0, 0.5, 0.25, 0.1)
"""Fractions of a step that are tried, the largest first."""

CACHE_SIZE = 8
"""Number of models whose result is cached, by their identity."""

CacheKey = tuple[int, tuple[int, ...]]

_cache: OrderedDict[CacheKey, tuple[Estimate, Sequence[SampledRecording], Reals]] = OrderedDict()


def cross_validated_squares(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
    """Return the sums of squares (recordings, outputs) of left-out blocks; infinite if not fitted.

    The result is cached, because the base is compared with every candidate.
    """
    key = id(model), tuple(id(one) for one in series)
    if key not in _cache:
        _cache[key] = model, series, _compute_cross_validated_squares(model, series)
        if len(_cache) > CACHE_SIZE:
            _cache.popitem(last=False)
    _cache.move_to_end(key)
    return _cache[key][2]


def _compute_cross_validated_squares(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
    """Return the sums of squares of left-out blocks without the cache."""
    found = np.zeros((len(series), len(model.candidate.predictor.outputs)))
    if model.normal_equations is None:
        return np.full(found.shape, np.inf)
    for fold in range(FOLDS):
        prediction = _predict_without_fold(model, series, fold)
        if not prediction.is_complete:
            return np.full(found.shape, np.inf)
        found += _fold_squares(prediction, fold, False)
    return found


def _predict_without_fold(
    model: Estimate, series: Sequence[SampledRecording], fold: int
) -> PredictionResult:
    """Return the prediction at the point that the normal equations give without a fold.

    A step that increases the cost of the other folds is shortened; if a tenth of it still does, the
    prediction of the model is returned.
    """
    assert model.normal_equations is not None
    scale = model.prediction.variances
    there = damped_step(
        model.candidate, model.point, model.normal_equations.without_fold(fold), 0.0
    )
    limit = _training_cost(model, model.prediction, model.point, fold, scale)
    for part in STEP_FRACTIONS:
        point = ParameterVector(
            model.point.shared + part * (there.shared - model.point.shared),
            model.point.per_recording + part * (there.per_recording - model.point.per_recording),
        )
        prediction = predict_with_gains_of(model, series, point)
        if (
            prediction.is_complete
            and _training_cost(model, prediction, point, fold, scale) <= limit
        ):
            return prediction
    return model.prediction


def _training_cost(
    model: Estimate, prediction: PredictionResult, point: ParameterVector, fold: int, scale: Reals
) -> float:
    """Return the cost [nats] of all folds but one."""
    squares = _fold_squares(prediction, fold, True)
    return 0.5 * float(np.sum(squares.sum(axis=0) / scale)) + point.prior_cost(model.candidate)


def _fold_squares(prediction: PredictionResult, fold: int, is_training: bool) -> Reals:
    """Return the sums of squares (recordings, outputs) of a fold,
    or of all others for `is_training`.
    """
    squares = prediction.robust_squares
    found = np.zeros((len(prediction.slices), squares.shape[1]))
    for block in prediction.blocks:
        if (block.fold != fold) == is_training:
            found[block.recording] += np.nansum(squares[block.part], axis=0)
    return found
