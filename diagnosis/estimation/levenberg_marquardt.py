"""Levenberg-Marquardt: parameters of a candidate by prediction errors, with priors and bounds.

The cost is the concentrated negative log-likelihood, N/2 log(mean square innovation) per output,
plus half the sum of squared coordinates. The Kalman gains are fixed during a step and recomputed
from the model at its end.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import (
    Estimate,
    evaluate,
    evaluate_near,
    predict_with_gains_of,
    with_normal_equations,
)
from diagnosis.estimation.innovations import NoiseLevels
from diagnosis.estimation.jacobian import Jacobian, broyden_update
from diagnosis.estimation.normal_equations import damped_step, predicted_gain
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, vector_of

MAX_ITERATIONS = 15
"""Steps with one difference Jacobian and Broyden updates."""
MIN_GAIN = 0.3
"""An iteration that gains less than this [nats] is the last one."""
MIN_GAIN_BROYDEN = 2.0
"""The same limit for iterations with Broyden updates of the Jacobian."""
MIN_GAIN_NEW_JACOBIAN = 1.0
"""A refinement with a new Jacobian that gains at least this [nats] is followed by another one."""
MAX_REFINEMENTS = 12
"""Maximum number of refinements; a tyre model had not converged after three."""
MIN_PREDICTED_GAIN = 0.05
"""A step with a smaller predicted gain [nats] is not evaluated."""
MIN_PREDICTED_SCREENING_GAIN = 1.0
"""The same limit during screening."""
INITIAL_DAMPING = 1e-3
MAX_DAMPING = 1e5
SCREENING_ITERATIONS, SINGLE_RECORDING_ITERATIONS = 8, 4
"""Iterations of screening after which a further one must gain a fraction of the total gain.

The second number applies to a single recording, which cannot separate chance from physics.
"""
LATE_GAIN_FRACTION = 0.1
"""This fraction."""
MIN_ITERATION_GAIN = 3.0
"""A screening iteration that gains less [nats] is the last one."""


def estimate_parameters(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
) -> Estimate:
    """Return the candidate at the point of least cost, found from `start`.

    `start` is a vector, or values [SI] of some parameters (the others start at their first start
    value, or at their declared value). The steps of `iterate` are followed by `refine`. If the cost
    at the start is infinite, the start is returned, without normal equations.
    """
    return refine(iterate(candidate, series, noise_levels, start), series)


def iterate_broyden(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    max_iterations: int,
) -> Estimate:
    """Return the result of damped steps with one difference Jacobian and Broyden updates.

    The steps end after `max_iterations`, when one gains less than `MIN_GAIN_BROYDEN` (2 nats), or
    when none lowers the cost. The result has the updated Jacobian at its point. If the cost at the
    start is infinite, the start is returned.
    """
    return _iterate_from(
        candidate, series, noise_levels, start, max_iterations, None, None
    ).with_jacobian(series)


def iterate(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    jacobian: Jacobian | None = None,
    nearby: Estimate | None = None,
) -> Estimate:
    """Return the point of `iterate_broyden` after at most `MAX_ITERATIONS` (15) steps.

    Normal equations and Jacobian of the result are None and empty, or those of an earlier point.
    `nearby` is an estimate of a similar model whose operating points are tried at the start;
    `jacobian` gives columns that are not computed by differences.
    """
    return _iterate_from(
        candidate, series, noise_levels, start, MAX_ITERATIONS, jacobian, nearby
    ).estimate


def _iterate_from(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    max_iterations: int,
    jacobian: Jacobian | None,
    nearby: Estimate | None,
) -> _IterationResult:
    """Return the steps from `start`; the start itself if its cost is infinite."""
    point = (
        start if isinstance(start, ParameterVector) else vector_of(candidate, len(series), start)
    )
    now = evaluate_near(candidate, series, noise_levels, point, nearby)
    if not _is_finite(now):
        return _IterationResult(now)
    return _iterate_steps(with_normal_equations(now, series, jacobian), series, max_iterations)


def refine(estimate: Estimate, series: Sequence[SampledRecording]) -> Estimate:
    """Return a converged fit: new difference Jacobians alternate with damped steps.

    It ends when the steps after a new Jacobian gain less than `MIN_GAIN_NEW_JACOBIAN` (1 nat), or
    after `MAX_REFINEMENTS` (12). Steps end at a gain below `MIN_GAIN` or after `MAX_ITERATIONS`.
    The result has normal equations. An estimate with infinite cost is returned unchanged.
    """
    if not _is_finite(estimate):
        return estimate
    for _ in range(MAX_REFINEMENTS):
        estimate = with_normal_equations(estimate, series)
        further = _iterate_steps(estimate, series, MAX_ITERATIONS, min_gain=MIN_GAIN)
        if estimate.cost - further.estimate.cost < MIN_GAIN_NEW_JACOBIAN:
            return further.with_jacobian(series)
        estimate = further.estimate
    return with_normal_equations(estimate, series)


def _is_finite(estimate: Estimate) -> bool:
    """Return whether the cost is finite."""
    return bool(np.isfinite(estimate.cost))


@dataclass(frozen=True)
class _IterationResult:
    """The estimate after damped steps, and the two ends of the last step.

    The Jacobian of the estimate has to be updated along the last step; it is current if that is
    None.
    """

    estimate: Estimate
    last_step: tuple[Estimate, Estimate] | None = None

    def with_jacobian(self, series: Sequence[SampledRecording]) -> Estimate:
        """Return the estimate with its Jacobian and normal equations."""
        return (
            _update_jacobian(*self.last_step, self.estimate, series)
            if self.last_step
            else self.estimate
        )


def _iterate_steps(
    estimate: Estimate,
    series: Sequence[SampledRecording],
    max_iterations: int,
    min_gain: float = MIN_GAIN_BROYDEN,
) -> _IterationResult:
    """Return the result of damped steps until one gains less than `min_gain` [nats].

    After each step the Kalman gains are recomputed; the old gains stay if the new ones cost more by
    at least `MIN_GAIN`.
    """
    damping, result = INITIAL_DAMPING, _IterationResult(estimate)
    for _ in range(max_iterations):
        estimate = result.with_jacobian(series)
        better, damping = search_damping(estimate, series, damping)
        if better is None:
            return _IterationResult(estimate)
        reevaluated = evaluate(
            estimate.candidate, series, better.noise_levels, better.point, better.prediction
        )
        best = reevaluated if reevaluated.cost < better.cost + MIN_GAIN else better
        result = _IterationResult(best, (estimate, better))
        if estimate.cost - better.cost < min_gain:
            break
    return result


def _update_jacobian(
    before: Estimate, after: Estimate, estimate: Estimate, series: Sequence[SampledRecording]
) -> Estimate:
    """Return `estimate` with the Jacobian of `before`, updated along the step to `after`.

    The gains of `estimate` may differ from those of the step.
    """
    first, last = before.point, after.point
    step = ParameterVector(last.shared - first.shared, last.per_recording - first.per_recording)
    columns = broyden_update(
        before.candidate, before.jacobian, before.prediction, after.prediction, step
    )
    return with_normal_equations(estimate, series, columns)


def iterate_with_jacobian(
    estimate: Estimate, series: Sequence[SampledRecording], jacobian: Jacobian, max_iterations: int
) -> Estimate:
    """Return the result of screening steps that reuse the columns of a similar model's Jacobian.

    Columns that the similar model lacks are computed by differences at each step; Broyden updates
    of these failed for shafts of unequal stiffness, which start far from their optimum. The steps
    end when one gains less than `MIN_ITERATION_GAIN` (3 nats), or, from iteration
    `SCREENING_ITERATIONS` (8, or 4 for a single recording) on, less than `LATE_GAIN_FRACTION` (a
    tenth) of the total. If no step is found from the initial damping, the estimate records
    `jacobian` as exhausted; an estimate that is exhausted for it or has an infinite cost is
    returned unchanged.
    """
    if not _is_finite(estimate) or estimate.exhausted_jacobian is jacobian:
        return estimate
    current, damping = estimate, INITIAL_DAMPING
    early = SINGLE_RECORDING_ITERATIONS if len(series) == 1 else SCREENING_ITERATIONS
    for iteration in range(1, max_iterations + 1):
        least_damping = damping
        better, damping = search_damping(
            with_normal_equations(current, series, jacobian),
            series,
            damping,
            min_gain=MIN_PREDICTED_SCREENING_GAIN,
        )
        if better is None:
            is_all = least_damping <= INITIAL_DAMPING
            return dataclasses.replace(current, exhausted_jacobian=jacobian) if is_all else current
        gained, current = current.cost - better.cost, better
        late = LATE_GAIN_FRACTION * (estimate.cost - current.cost) if iteration >= early else 0.0
        if gained < max(MIN_ITERATION_GAIN, late):
            break
    return current


def refresh_gains(estimate: Estimate, series: Sequence[SampledRecording]) -> Estimate:
    """Return the estimate with Kalman gains for its own operating points, if it then costs less.

    Otherwise, also at equal cost, the estimate itself is returned. A refreshed one has no normal
    equations and no Jacobian.
    """
    refreshed = evaluate(
        estimate.candidate, series, estimate.noise_levels, estimate.point, estimate.prediction
    )
    return min(estimate, refreshed, key=lambda one: one.cost)


def search_damping(
    estimate: Estimate,
    series: Sequence[SampledRecording],
    damping: float,
    per_recording_only: bool = False,
    min_gain: float = MIN_PREDICTED_GAIN,
) -> tuple[Estimate | None, float]:
    """Return an estimate of lower cost after one damped step, and the damping for the next one.

    The damping grows by 10 until a step lowers the cost, and is divided by 10 after success (at
    least 1e-9). Steps with a predicted gain below `min_gain` [nats] are not evaluated. The estimate
    is None if the damping reaches `MAX_DAMPING` (1e5). A result keeps the normal equations and the
    Jacobian of the old point. With `per_recording_only` only coordinates per recording move.
    """
    assert estimate.normal_equations is not None
    while damping < MAX_DAMPING:
        point = damped_step(
            estimate.candidate,
            estimate.point,
            estimate.normal_equations,
            damping,
            per_recording_only,
        )
        if (
            predicted_gain(estimate.candidate, estimate.point, estimate.normal_equations, point)
            < min_gain
        ):
            damping *= 10.0
            continue
        prediction = predict_with_gains_of(estimate, series, point)
        cost = prediction.negative_log_likelihood() + point.prior_cost(estimate.candidate)
        if cost < estimate.cost:
            better = dataclasses.replace(
                estimate, point=point, cost=cost, prediction=prediction, exhausted_jacobian=None
            )
            return better, max(damping / 10.0, 1e-9)
        damping *= 10.0
    return None, damping
