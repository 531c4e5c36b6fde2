"""Estimate: a candidate at a point, and how it foresees the recordings there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.innovations import (
    Innovations,
    KalmanGains,
    NoiseLevels,
    PredictionResult,
    noise_levels_at,
    predict,
    predict_at_points,
    predict_with_gains,
)
from diagnosis.estimation.jacobian import Jacobian, difference_jacobian
from diagnosis.estimation.kalman_gain import kalman_gains
from diagnosis.estimation.normal_equations import NormalEquations, normal_equations_of
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, all_values_at, values_at


def share_operating_points(
    candidate: Candidate,
    prediction: PredictionResult,
    near_candidate: Candidate,
    near_prediction: PredictionResult,
) -> PredictionResult:
    """Return the `prediction` outcome of a candidate with states and modes of a `near_prediction` one of a model
    near it, for the same recordings; as it is where their modes or samples are others.
    """
    mine, theirs = prediction.runs.stacked, near_prediction.runs.stacked
    is_alike = (
        candidate.predictor.modes == near_candidate.predictor.modes and prediction.is_complete
    )
    if not (is_alike and near_prediction.is_complete and len(mine.states) == len(theirs.states)):
        return prediction
    states, places = (
        mine.states.copy(),
        {n: k for k, n in enumerate(near_candidate.predictor.states)},
    )
    for column, name in enumerate(candidate.predictor.states):
        if name in places:
            states[:, column] = theirs.states[:, places[name]]
    if not np.all(np.isfinite(states)):
        return prediction
    whole = dataclasses.replace(mine, states=states, modes=theirs.modes)
    return dataclasses.replace(prediction, runs=dataclasses.replace(prediction.runs, stacked=whole))


LOG_LEVEL_STEP = 0.05
"""Change of the logarithm of a level for a difference."""


@dataclass(frozen=True)
class Estimate:
    """A candidate at a point: cost [nats] with priors, and how it foresees the recordings.

    `normal` are the normal equations of the last round, None before the first, and `columns` what
    they were made from. `in_vain` are the columns of a model near it with which steps of screening
    were sought from here, and led nowhere.
    """

    candidate: Candidate
    point: ParameterVector
    cost: float
    prediction: PredictionResult = field(repr=False)
    gains: KalmanGains = field(repr=False)
    noise_levels: NoiseLevels = field(repr=False)
    normal_equations: NormalEquations | None = field(default=None, repr=False)
    jacobian: Jacobian = field(default_factory=dict, repr=False)
    exhausted_jacobian: Jacobian | None = field(default=None, repr=False)

    @property
    def negative_log_likelihood(self) -> float:
        """The cost without priors [nats]."""
        return self.prediction.negative_log_likelihood()

    def values(self, recording: int) -> dict[str, float]:
        """Return the parameters [SI] of a recording."""
        return values_at(self.candidate, self.point, recording)


def evaluate(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    point: ParameterVector,
    nearby: PredictionResult | None = None,
) -> Estimate:
    """Return a candidate at a point, with gains made where its modes were seen.

    `nearby` is where they were seen at a point near it, if that is known.
    """
    values = values_at(candidate, point, 0)
    gains = kalman_gains(candidate, series, values, noise_levels, nearby)
    prediction = predict_at(candidate, series, point, gains, noise_levels)
    if nearby is None and prediction.is_complete:
        gains = kalman_gains(candidate, series, values, noise_levels, prediction)
        prediction = predict_at(candidate, series, point, gains, noise_levels)
    cost = prediction.negative_log_likelihood() + point.prior_cost(candidate)
    return Estimate(candidate, point, cost, prediction, gains, noise_levels)


def evaluate_near(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    point: ParameterVector,
    nearby: Estimate | None,
) -> Estimate:
    """Return a candidate at a point, with gains made where its modes were seen: where it had them
    itself, or where a model `nearby` it had them, whichever foresees better.
    """
    if nearby is None:
        return evaluate(candidate, series, noise_levels, point)
    gains = kalman_gains(candidate, series, values_at(candidate, point, 0), noise_levels)
    own = predict_at(candidate, series, point, gains, noise_levels)
    if not own.is_complete:
        return Estimate(candidate, point, np.inf, own, gains, noise_levels)
    near = share_operating_points(candidate, own, nearby.candidate, nearby.prediction)
    first = evaluate(candidate, series, noise_levels, point, own)
    if near is own:
        return first
    return min(
        first, evaluate(candidate, series, noise_levels, point, near), key=lambda one: one.cost
    )


def with_normal_equations(
    estimate: Estimate, series: Sequence[SampledRecording], jacobian: Jacobian | None = None
) -> Estimate:
    """Return an estimate with the normal equations at its point.

    `jacobian` are columns of a model near it, which are not looked for again.
    """

    def run(points: Sequence[ParameterVector]) -> list[Innovations]:
        return innovations_at(estimate, series, points)

    candidate, prediction = estimate.candidate, estimate.prediction
    jacobian = jacobian or {}
    fresh = [one.name for one in candidate.compiled.uncertain if one.name not in jacobian]
    columns = {**jacobian, **difference_jacobian(candidate, estimate.point, prediction, run, fresh)}
    columns |= _noise_parameter_jacobian(
        estimate, series, [o.name for o in candidate.noise_parameters if o.name not in jacobian]
    )
    normal = normal_equations_of(candidate, prediction, columns)
    return dataclasses.replace(estimate, normal_equations=normal, jacobian=columns)


def _noise_parameter_jacobian(
    estimate: Estimate, series: Sequence[SampledRecording], names: Sequence[str]
) -> Jacobian:
    """Return how innovations change with levels: with the gains that are made with these."""
    candidate, jacobian = estimate.candidate, {}
    places = [candidate.names.index(name) for name in names]
    moved = [
        estimate.point.perturb(candidate, k, LOG_LEVEL_STEP / candidate.free_parameters[k].sd)
        for k in places
    ]
    gains = [gains_at(estimate, series, there) for there in moved]
    values = all_values_at(candidate, estimate.point)[: len(series)]
    runs = predict_with_gains(candidate, series, values, gains, estimate.noise_levels.huber_limits)
    for name, k, there, run in zip(names, places, moved, runs, strict=True):
        changes = (run.stacked - estimate.prediction.stacked) / (
            there.shared[k] - estimate.point.shared[k]
        )
        jacobian[name] = np.where(np.isfinite(changes), changes, 0.0)
    return jacobian


def gains_at(
    estimate: Estimate, series: Sequence[SampledRecording], point: ParameterVector
) -> KalmanGains:
    """Return the gains of an estimate with the levels that its candidate has at a point."""
    if not estimate.candidate.noise_parameters:
        return estimate.gains
    noise_levels, values = (
        noise_levels_at(estimate.candidate, point, estimate.noise_levels),
        estimate.values(0),
    )
    return kalman_gains(estimate.candidate, series, values, noise_levels, estimate.prediction)


def predict_at(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    point: ParameterVector,
    gains: KalmanGains,
    noise_levels: NoiseLevels,
) -> PredictionResult:
    """Return how a candidate foresees recordings at a point with some gains."""
    values = all_values_at(candidate, point)[: len(series)]
    return predict(candidate, series, values, gains, noise_levels.huber_limits)


def predict_with_gains_of(
    estimate: Estimate, series: Sequence[SampledRecording], point: ParameterVector
) -> PredictionResult:
    """Return how a model foresees some recordings at a point, with the gains of the estimate."""
    return predict_at(estimate.candidate, series, point, estimate.gains, estimate.noise_levels)


def innovations_at(
    estimate: Estimate, series: Sequence[SampledRecording], points: Sequence[ParameterVector]
) -> list[Innovations]:
    """Return what a model does not foresee at some points, with the gains of the estimate."""
    candidate, gains = estimate.candidate, estimate.gains
    values = [all_values_at(candidate, point)[: len(series)] for point in points]
    return (
        predict_at_points(candidate, series, values, gains, estimate.noise_levels.huber_limits)
        if points
        else []
    )


def evaluate_with_gains_of(
    estimate: Estimate, series: Sequence[SampledRecording], point: ParameterVector
) -> Estimate:
    """Return an estimate at a point for some recordings, with the gains that it has."""
    prediction = predict_with_gains_of(estimate, series, point)
    cost = prediction.negative_log_likelihood() + point.prior_cost(estimate.candidate)
    return Estimate(
        estimate.candidate, point, cost, prediction, estimate.gains, estimate.noise_levels
    )
