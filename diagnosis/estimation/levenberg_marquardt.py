"""Estimation: the parameters of a candidate by prediction errors, with priors, within their ranges.

Levenberg-Marquardt on the concentrated likelihood: N/2 log(mean square innovation) per channel
plus half the squares of the coordinates. The gains are held while a step is sought, and made anew
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
    gains_at,
    predict_at,
    with_normal_equations,
)
from diagnosis.estimation.innovations import NoiseLevels, noise_levels_at
from diagnosis.estimation.jacobian import Jacobian, broyden_update
from diagnosis.estimation.normal_equations import damped_step, predicted_gain
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, vector_of

MAX_ITERATIONS = 15
MIN_GAIN = 0.3
"""A round that gains less than this [nats] is the last."""
MIN_GAIN_BROYDEN = 2.0
"""The same where slopes were carried along steps from where they were looked for."""
MIN_GAIN_NEW_JACOBIAN = 1.0
"""Steps that gain more [nats] once slopes were looked for anew have them looked for again."""
MAX_REFINEMENTS = 12
"""How often they are at most: a tyre's mode had not come to rest after three."""
MIN_PREDICTED_GAIN = 0.05
"""A step that is foreseen to gain less than this [nats] is not tried."""
MIN_PREDICTED_SCREENING_GAIN = 1.0
"""The same while candidates are screened."""
INITIAL_DAMPING = 1e-3
MAX_DAMPING = 1e5
SCREENING_ITERATIONS, SINGLE_RECORDING_ITERATIONS = 8, 4
"""Most rounds while candidates are screened, and those after which, on a single recording, which
cannot tell chance from physics, a further one has to gain much."""
LATE_GAIN_FRACTION = 0.1
"""What is much: part of all that was gained."""
MIN_ITERATION_GAIN = 3.0
"""A round of screening that gains less [nats] is the last."""


def estimate_parameters(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    max_iterations: int = MAX_ITERATIONS,
    jacobian: Jacobian | None = None,
) -> Estimate:
    """Return the point that foresees the recordings best, from `start` [SI].

    `jacobian` are slopes of the candidate near the start, if there are such.
    """
    return refine(
        iterate(candidate, series, noise_levels, start, max_iterations, jacobian),
        series,
        max_iterations,
    )


def iterate_broyden(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    max_iterations: int = MAX_ITERATIONS,
    jacobian: Jacobian | None = None,
    nearby: Estimate | None = None,
) -> Estimate:
    """Return where steps lead with slopes that are looked for once, and carried along them.

    A model `nearby` it may tell where the modes are at the start.
    """
    return _iterate_from(
        candidate, series, noise_levels, start, max_iterations, jacobian, nearby
    ).with_jacobian(series)


def iterate(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    max_iterations: int = MAX_ITERATIONS,
    jacobian: Jacobian | None = None,
    nearby: Estimate | None = None,
) -> Estimate:
    """Return what `followed` does, without slopes at its end: those are looked for anew."""
    return _iterate_from(
        candidate, series, noise_levels, start, max_iterations, jacobian, nearby
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
    point = (
        start if isinstance(start, ParameterVector) else vector_of(candidate, len(series), start)
    )
    now = evaluate_near(candidate, series, noise_levels, point, nearby)
    if not _is_finite(now):
        return _IterationResult(now)
    return _iterate_steps(with_normal_equations(now, series, jacobian), series, max_iterations)


def refine(
    estimate: Estimate, series: Sequence[SampledRecording], max_iterations: int = MAX_ITERATIONS
) -> Estimate:
    """Return a fit that is done: slopes are looked for at its end, and steps sought with these."""
    if not _is_finite(estimate):
        return estimate
    for _ in range(MAX_REFINEMENTS):
        estimate = with_normal_equations(estimate, series)
        further = _iterate_steps(estimate, series, max_iterations, min_gain=MIN_GAIN)
        if estimate.cost - further.estimate.cost < MIN_GAIN_NEW_JACOBIAN:
            return further.with_jacobian(series)
        estimate = further.estimate
    return with_normal_equations(estimate, series)


def _is_finite(estimate: Estimate) -> bool:
    return bool(np.isfinite(estimate.cost))


@dataclass(frozen=True)
class _IterationResult:
    """Where steps led: `there`, and the ends of the last one, along which slopes are to be carried
    to it; None where it has them.
    """

    estimate: Estimate
    last_step: tuple[Estimate, Estimate] | None = None

    def with_jacobian(self, series: Sequence[SampledRecording]) -> Estimate:
        """Return where the steps led, with its slopes."""
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
    """Return where steps lead until one gains less than the `min_gain` [nats]."""
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
    """Return an estimate `estimate` with the slopes of the one `before`, carried along the step after
    which it is. The gains there may be others than those of the step.
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
    """Return where some steps lead for which `jacobian` columns of a model near it are good enough.

    Slopes of what the other model has not are looked for at each step: carried ones did not find
    unequal shafts, which begin far from where they fit.
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
    """Return an estimate with gains made where it is, if they are better than those it has."""
    refreshed = evaluate(
        estimate.candidate, series, estimate.noise_levels, estimate.point, estimate.prediction
    )
    return min(estimate, refreshed, key=lambda one: one.cost)


def search_damping(
    estimate: Estimate,
    series: Sequence[SampledRecording],
    damping: float,
    own_only: bool = False,
    min_gain: float = MIN_PREDICTED_GAIN,
) -> tuple[Estimate | None, float]:
    """Return a better point and the damping that led there; None where there is none.

    A step that is foreseen to gain less than the `min_gain` [nats] is not tried.
    """
    assert estimate.normal_equations is not None
    while damping < MAX_DAMPING:
        point = damped_step(
            estimate.candidate, estimate.point, estimate.normal_equations, damping, own_only
        )
        if (
            predicted_gain(estimate.candidate, estimate.point, estimate.normal_equations, point)
            < min_gain
        ):
            damping *= 10.0
            continue
        gains = gains_at(estimate, series, point)
        prediction = predict_at(estimate.candidate, series, point, gains, estimate.noise_levels)
        cost = prediction.negative_log_likelihood() + point.prior_cost(estimate.candidate)
        if cost < estimate.cost:
            noise_levels = noise_levels_at(estimate.candidate, point, estimate.noise_levels)
            better = Estimate(estimate.candidate, point, cost, prediction, gains, noise_levels)
            better = dataclasses.replace(
                better, normal_equations=estimate.normal_equations, jacobian=estimate.jacobian
            )
            return better, max(damping / 10.0, 1e-9)
        damping *= 10.0
    return None, damping
