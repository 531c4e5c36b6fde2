"""Estimate: a candidate at a parameter vector, with its gains and its prediction of recordings."""

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
    predict,
    predict_at_points,
)
from diagnosis.estimation.jacobian import Jacobian, difference_jacobian
from diagnosis.estimation.kalman_gain import kalman_gains
from diagnosis.estimation.normal_equations import NormalEquations, normal_equations_of
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, all_values_at, values_at

GAIN_SCALES = (0.0, 0.1, 0.25, 0.5, 0.7, 0.85, 1.0, 1.2, 1.4)
"""Factors of the Kalman gains that are tried; 0 is a simulation."""


def share_operating_points(
    candidate: Candidate,
    prediction: PredictionResult,
    near_candidate: Candidate,
    near_prediction: PredictionResult,
) -> PredictionResult:
    """Return a prediction with the modes and the common states of that of a similar model.

    Both are of the same recordings; states are matched by name, and only `runs` is changed.
    `prediction` itself is returned if the modes of the models or the numbers of samples differ, if
    a run was incomplete, or if a state of the result would not be finite.
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


@dataclass(frozen=True)
class Estimate:
    """A candidate at a parameter vector, its cost with priors [nats] and its prediction.

    `normal_equations` and `jacobian` are those of the last iteration, None and empty before the
    first. `exhausted_jacobian` is the Jacobian of a similar model with which screening found no
    better point from here.
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
        """The cost without priors [nats]; infinite if a run diverged."""
        return self.prediction.negative_log_likelihood()

    def values(self, recording: int) -> dict[str, float]:
        """Return the values [SI] of the free parameters for one recording (its index), by name.

        Shared parameters have the same value for each recording.
        """
        return values_at(self.candidate, self.point, recording)


def evaluate(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    point: ParameterVector,
    nearby: PredictionResult | None = None,
) -> Estimate:
    """Return a candidate at a point, with Kalman gains for its operating points.

    The operating points are those of the prediction `nearby`. Without it, a first prediction with
    gains for the initial state gives the operating points for the final gains, or a simulation if
    that prediction diverges: a machine that starts at rest may have another gain once it moves. The
    gains are computed with the values of the first recording. The cost is
    infinite if a run diverges. The estimate has no normal equations.
    """
    values = values_at(candidate, point, 0)
    gains = kalman_gains(candidate, series, values, noise_levels, nearby)
    prediction = predict_at(candidate, series, point, gains, noise_levels)
    if nearby is None:
        seen = prediction
        if not seen.is_complete:
            seen = predict_at(candidate, series, point, gains.scaled(0.0), noise_levels)
        if seen.is_complete:
            gains = kalman_gains(candidate, series, values, noise_levels, seen)
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
    """Return the candidate at a point with the better of two sets of Kalman gains, by cost.

    One set is for the candidate's own operating points, the other for those of the similar model
    `nearby`; the own ones stay if both cost the same or the models cannot be matched
    (`share_operating_points`). The cost is infinite if the candidate diverges with gains for its
    initial state; without `nearby` this is `evaluate`.
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


def with_best_gain_scale(estimate: Estimate, series: Sequence[SampledRecording]) -> Estimate:
    """Return an estimate with the factor of its Kalman gains in `GAIN_SCALES` of least cost.

    The steps of a fit hold the gains of an earlier point, so a parameter that scales an output can
    adapt the gain to the noise. With a free factor all models that are compared can do so. The
    factor is part of the noise levels of the result. A simulation has no gains and is returned.
    """
    levels, tried = estimate.noise_levels, [estimate]
    if levels.is_output_error or not np.isfinite(estimate.cost):
        return estimate
    if levels.gain_scale > 0.0:
        whole = estimate.gains.scaled(1.0 / levels.gain_scale)
    else:
        values, levels = estimate.values(0), dataclasses.replace(levels, gain_scale=1.0)
        whole = kalman_gains(estimate.candidate, series, values, levels, estimate.prediction)
    for scale in GAIN_SCALES:
        other = dataclasses.replace(
            estimate,
            gains=whole.scaled(scale),
            noise_levels=dataclasses.replace(levels, gain_scale=scale),
        )
        prediction = predict_with_gains_of(other, series, estimate.point)
        cost = prediction.negative_log_likelihood() + estimate.point.prior_cost(estimate.candidate)
        tried.append(dataclasses.replace(other, prediction=prediction, cost=cost))
    return min(tried, key=lambda one: one.cost)


def with_normal_equations(
    estimate: Estimate, series: Sequence[SampledRecording], jacobian: Jacobian | None = None
) -> Estimate:
    """Return an estimate with the Jacobian and the normal equations at its point.

    Columns given in `jacobian` (by name, of a similar model) are used as they are; those of other
    parameters are computed by finite differences. The point, gains, cost and
    prediction do not change.
    """

    def run(points: Sequence[ParameterVector]) -> list[Innovations]:
        return innovations_at(estimate, series, points)

    candidate, prediction = estimate.candidate, estimate.prediction
    jacobian = jacobian or {}
    fresh = [one.name for one in candidate.free_parameters if one.name not in jacobian]
    columns = {**jacobian, **difference_jacobian(candidate, estimate.point, prediction, run, fresh)}
    normal = normal_equations_of(candidate, prediction, columns)
    return dataclasses.replace(estimate, normal_equations=normal, jacobian=columns)


def predict_at(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    point: ParameterVector,
    gains: KalmanGains,
    noise_levels: NoiseLevels,
) -> PredictionResult:
    """Return the prediction of recordings by a candidate at a point, with given gains.

    Of `noise_levels` only the Huber limits are used. Values of the point beyond the number of
    recordings are ignored.
    """
    values = all_values_at(candidate, point)[: len(series)]
    return predict(candidate, series, values, gains, noise_levels.huber_limits)


def predict_with_gains_of(
    estimate: Estimate, series: Sequence[SampledRecording], point: ParameterVector
) -> PredictionResult:
    """Return the prediction by the estimate's candidate at `point`, with the estimate's gains.

    The Huber limits are those of the estimate; recordings may differ from those of its fit.
    """
    return predict_at(estimate.candidate, series, point, estimate.gains, estimate.noise_levels)


def innovations_at(
    estimate: Estimate, series: Sequence[SampledRecording], points: Sequence[ParameterVector]
) -> list[Innovations]:
    """Return the innovations of recordings at each of several points, with the estimate's gains.

    They are in the order of `points`; empty for no points.
    """
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
    """Return the estimate at another point, or for other recordings, with its own gains.

    Cost and prediction are new; the result has no normal equations and no Jacobian.
    """
    prediction = predict_with_gains_of(estimate, series, point)
    cost = prediction.negative_log_likelihood() + point.prior_cost(estimate.candidate)
    return Estimate(
        estimate.candidate, point, cost, prediction, estimate.gains, estimate.noise_levels
    )
