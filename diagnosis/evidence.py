"""Evidence: what a model gains over another on the training recordings, and on parts left out.

Every fifth block in time of each recording is left out by influence: the point without them is one
step of the normal equations of the others away (the infinitesimal jackknife, Efron 1982); from
there they are foreseen.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate, predict_with_gains_of
from diagnosis.normal import damped_step
from diagnosis.point import ParameterVector
from diagnosis.prediction import FOLDS, PredictionResult
from diagnosis.series import SampledRecording

Reals = NDArray[np.float64]
STEP_FRACTIONS = (1.0, 0.5, 0.25, 0.1)
"""Parts of a step that are tried."""
MAX_LAG = 0.25
"""Seconds over which innovations may hang together."""
CACHE_SIZE = 8
"""Models of which what was left out is kept, the latest ones; known by their identity."""


@dataclass(frozen=True)
class LikelihoodGain:
    """Gains [nats]: `train` after the price of the parameters, `left_out` over all blocks.

    `each` (recordings,) is what is gained left out in each.
    """

    penalised: float
    cross_validated: float
    by_recording: tuple[float, ...]

    @property
    def smaller(self) -> float:
        """The smaller of the two."""
        return min(self.penalised, self.cross_validated)

    @property
    def total(self) -> float:
        """Their sum: what candidates are ranked by."""
        return self.penalised + self.cross_validated


CacheKey = tuple[int, tuple[int, ...]]
_cache: OrderedDict[CacheKey, tuple[Estimate, Sequence[SampledRecording], Reals]] = OrderedDict()


def likelihood_gain(
    model: Estimate, base: Estimate, series: Sequence[SampledRecording]
) -> LikelihoodGain:
    """Return what a model gains over a base that it extends; one that is unstable loses all."""
    if not np.isfinite(model.cost):
        return LikelihoodGain(-np.inf, -np.inf, (-np.inf,) * len(series))
    effective_fraction = 1.0 / integrated_autocorrelation(model, series)
    count = float(np.sum(model.prediction.counts))
    extra_parameters = _parameter_count(model, len(series)) - _parameter_count(base, len(series))
    penalty = 0.5 * extra_parameters * np.log(max(count * effective_fraction, 2.0))
    train = effective_fraction * (base.cost - model.cost) - penalty
    before, after = _cross_validated_squares(base, series), _cross_validated_squares(model, series)
    each = effective_fraction * _gain_by_recording(before, after, model.prediction.counts)
    return LikelihoodGain(float(train), float(np.sum(each)), tuple(float(one) for one in each))


def subtract_gains(total: LikelihoodGain, parts: Sequence[LikelihoodGain]) -> LikelihoodGain:
    """Return what is left of a gain when others have theirs."""
    each = zip(total.by_recording, *(part.by_recording for part in parts), strict=True)
    return LikelihoodGain(
        total.penalised - sum(part.penalised for part in parts),
        total.cross_validated - sum(part.cross_validated for part in parts),
        tuple(first - sum(rest) for first, *rest in each),
    )


def add_gains(base_gain: LikelihoodGain, added_gain: LikelihoodGain) -> LikelihoodGain:
    """Return a gain with what was gained after it."""
    each = zip(base_gain.by_recording, added_gain.by_recording, strict=True)
    total = tuple(first + second for first, second in each)
    return LikelihoodGain(
        base_gain.penalised + added_gain.penalised,
        base_gain.cross_validated + added_gain.cross_validated,
        total,
    )


def integrated_autocorrelation(model: Estimate, series: Sequence[SampledRecording]) -> float:
    """Return how many innovations count as one: 1 + 2 sum of squared autocorrelations, at least 1.

    (Bartlett 1946, for a quadratic function of them.)
    """
    return _integrated_autocorrelation(model.prediction.innovations, float(series[0].period))


def integrated_autocorrelation_by_recording(
    model: Estimate, series: Sequence[SampledRecording]
) -> Reals:
    """Return how many innovations of each recording count as one: (recordings,)."""
    period = float(series[0].period)
    return np.array(
        [_integrated_autocorrelation([one], period) for one in model.prediction.innovations]
    )


def _integrated_autocorrelation(innovations: Sequence[Reals], period: float) -> float:
    lags = max(1, round(MAX_LAG / period))
    by_output = []
    for channel in range(innovations[0].shape[1]):
        by_recording = [e[np.isfinite(e[:, channel]), channel] for e in innovations]
        power = sum(float(e @ e) for e in by_recording)
        total = 1.0
        for lag in range(1, lags + 1) if power > 0.0 else ():
            autocovariance = sum(float(e[lag:] @ e[:-lag]) for e in by_recording if len(e) > lag)
            total += 2.0 * (autocovariance / power) ** 2
        by_output.append(total)
    return float(np.mean(by_output))


def _parameter_count(model: Estimate, recordings: int) -> int:
    return sum(recordings if one.per_recording else 1 for one in model.candidate.free_parameters)


def _gain_by_recording(before: Reals, after: Reals, counts: Reals) -> Reals:
    """Return the gain [nats] in each recording, N/2 log of the ratio of mean squares in all.

    `before` and `after` are sums of squares (recordings, seen). What a recording has of the gain is
    what it has of the difference.
    """
    if not (np.all(np.isfinite(before)) and np.all(np.isfinite(after))):
        return np.full(len(before), np.inf if np.all(np.isfinite(after)) else -np.inf)
    first, second = before.sum(axis=0), after.sum(axis=0)
    apart = first - second
    ratio = np.log(first / second)
    weight = np.where(
        np.abs(ratio) > 1e-12, ratio / np.where(apart == 0.0, 1.0, apart), 1.0 / first
    )
    return np.asarray(0.5 * (before - after) @ (counts * weight), dtype=np.float64)


def _cross_validated_squares(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
    """Return the squares (recordings, seen) of each block at the point that the others ask for.

    What was found of the latest models is kept: a base is asked beside each candidate.
    """
    key = id(model), tuple(id(one) for one in series)
    if key not in _cache:
        _cache[key] = model, series, _compute_cross_validated_squares(model, series)
        if len(_cache) > CACHE_SIZE:
            _cache.popitem(last=False)
    _cache.move_to_end(key)
    return _cache[key][2]


def _compute_cross_validated_squares(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
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
    """Return the recordings foreseen from where a model would be without a fold.

    A step that does not do the others any good is shortened: the model is not as linear as that.
    Where not even a tenth of it does, the model stays where it is.
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
    """Return the cost [nats] of what is not left out."""
    squares = _fold_squares(prediction, fold, True)
    return 0.5 * float(np.sum(squares.sum(axis=0) / scale)) + point.prior_cost(model.candidate)


def _fold_squares(prediction: PredictionResult, fold: int, is_training: bool) -> Reals:
    """Return the sums of squares (recordings, seen) of a fold, or of all others."""
    squares = prediction.robust_squares
    found = np.zeros((len(prediction.slices), squares.shape[1]))
    for block in prediction.blocks:
        if (block.fold != fold) == is_training:
            found[block.recording] += np.nansum(squares[block.part], axis=0)
    return found
