"""Per recording parameters: re-estimation of phases, grades and the like with all else fixed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import (
    Estimate,
    evaluate,
    evaluate_with_gains_of,
    innovations_at,
    with_normal_equations,
)
from diagnosis.estimation.levenberg_marquardt import INITIAL_DAMPING, search_damping
from diagnosis.model.parameter_vector import ParameterVector

MAX_ITERATIONS = 5
"""Maximum number of steps of the parameters per recording."""


def reestimate_per_recording(model: Estimate, series: Sequence[SampledRecording]) -> Estimate:
    """Return a model for other recordings, with its own Kalman gains and shared parameters.

    Only parameters per recording are fitted, by at most `MAX_ITERATIONS` (5) steps, from the better
    of the shared vector and their declared starts (`restart_phases`). Without such parameters, or
    if the cost is infinite, nothing is fitted: each recording has the shared vector.
    """
    shared = model.point.shared
    now = evaluate_with_gains_of(
        model, series, ParameterVector(shared, np.tile(shared, (len(series), 1)))
    )
    if not any(one.per_recording for one in model.candidate.free_parameters):
        return now
    now = min(
        now,
        evaluate_with_gains_of(model, series, restart_phases(now, series).point),
        key=lambda one: one.cost,
    )
    damping = INITIAL_DAMPING
    still = np.zeros(now.prediction.stacked.shape)
    held = {one.name: still for one in model.candidate.free_parameters if not one.per_recording}
    for _ in range(MAX_ITERATIONS if np.isfinite(now.cost) else 0):
        better, damping = search_damping(
            with_normal_equations(now, series, held), series, damping, per_recording_only=True
        )
        if better is None:
            break
        now = better
    return now


def restart_phases(estimate: Estimate, series: Sequence[SampledRecording]) -> Estimate:
    """Return an estimate with each parameter per recording at its start of least cost, if better.

    Only parameters with several starts are tried, one after the other; the starts are compared for
    each recording by the sum of squared innovations over the variances, with the estimate's gains.
    The result is evaluated with new gains. Without such parameters, or if the cost is infinite, the
    estimate is returned. A phase that was fitted while other parameters were wrong may be at a
    local optimum.
    """
    uncertain = estimate.candidate.free_parameters
    own = [k for k, one in enumerate(uncertain) if one.per_recording and len(one.starts) > 1]
    if not own or not np.isfinite(estimate.cost):
        return estimate
    variances = estimate.prediction.variances
    best = estimate.point.per_recording.copy()
    lowest = np.sum(estimate.prediction.runs.squared_sums / variances, axis=1)
    for k in own:
        trials = [best.copy() for _ in uncertain[k].starts]
        for trial, start in zip(trials, uncertain[k].starts, strict=True):
            trial[:, k] = uncertain[k].coordinate(start)
        trials = [trial for trial in trials if not np.array_equal(trial, best)]
        points = [ParameterVector(estimate.point.shared, trial) for trial in trials]
        for trial, there in zip(trials, innovations_at(estimate, series, points), strict=True):
            each = np.sum(there.robust_square_sums / variances, axis=1)
            better = each < lowest
            best[better, k], lowest[better] = trial[better, k], each[better]
    point = ParameterVector(estimate.point.shared, best)
    return evaluate(estimate.candidate, series, estimate.noise_levels, point, estimate.prediction)
