"""Noise levels: the standard deviations of disturbances at each place, chosen by likelihood.

A disturbance of one unit changes a compared output by its own noise within `UNIT_RESPONSE_TIME`.
While effects are selected the levels are small, because a free disturbance would absorb the physics
that is sought.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, evaluate
from diagnosis.estimation.innovations import NoiseLevels, measured_noise_levels
from diagnosis.estimation.jacobian import Jacobian
from diagnosis.estimation.levenberg_marquardt import iterate
from diagnosis.estimation.noise_covariance import MAX_NOISE_RATIO, fit_noise_covariance
from diagnosis.estimation.operating_point import linearise_near, operating_points
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector

UNIT_RESPONSE_TIME = 0.2
"""Time [s] in which a disturbance of one unit changes an output by its noise."""
LEVELS = (0.0, 0.1, 0.3, 1.0, 3.0)
"""Grid of disturbance levels, in units; the last one is the largest during selection."""
INITIAL_LEVELS = (0.1, 0.3, 1.0)
"""Levels from which a base is fitted: a fit with a large level does not find a small one."""
SMALL_LEVEL = INITIAL_LEVELS[0]
"""The level from which a candidate is fitted first."""
ORDINARY_LEVEL = 0.1
"""Level of the ordinary disturbance of each balance, in units, held in every model."""
HUBER_STDS = 4.0
"""Huber limit of innovations, in their robust standard deviations."""
NOISE_FACTOR = 1.5
"""Factor of one step of the noise of inputs or of an output."""
MIN_GAIN = 2.0
"""Smallest gain [nats] of a changed level."""


def disturbance_units(
    candidate: Candidate, series: Sequence[SampledRecording], start: Mapping[str, float]
) -> dict[str, float]:
    """Return the unit [SI] of each disturbance state, by name.

    One unit changes some output by its measured noise after `UNIT_RESPONSE_TIME` (0.2 s), by the
    model linearised at the start of the first recording (at most 1e12 for a disturbance without
    response). `start` are values [SI] of parameters. Raises ValueError if the model cannot be
    linearised there.
    """
    output_noise = measured_noise_levels(series, {}).outputs
    mode, operating_point = next(iter(operating_points(candidate, series, None).items()))
    page = candidate.calibration_page(start, series[0])
    linear = linearise_near(candidate, page, mode, operating_point.states, operating_point.inputs)
    if linear is None:
        raise ValueError("the base is unstable where the first recording starts")
    count = max(1, round(UNIT_RESPONSE_TIME / float(series[0].period)))
    ahead = linear.c @ np.linalg.matrix_power(linear.phi, count)
    units = {}
    for name in candidate.disturbance_states:
        noise_ratios = np.abs(ahead[:, candidate.predictor.states.index(name)]) / output_noise
        units[name] = 1.0 / max(float(np.max(noise_ratios)), 1e-12)
    return units


def line_search_noise(
    estimate: Estimate,
    series: Sequence[SampledRecording],
    units: Mapping[str, float],
) -> Estimate:
    """Return an estimate with noise levels improved one at a time, its parameters fixed.

    The levels of disturbances in `units` move along `LEVELS`, up first, then down, from the nearest
    one; then the noise of all inputs and of each output changes by factors of `NOISE_FACTOR` (1.5),
    within `MAX_NOISE_RATIO` of the measured noise. A change is accepted if it gains more than
    `MIN_GAIN` (2 nats).
    """
    for name in units:
        level_index = _nearest_level(estimate.noise_levels.process.get(name, 0.0), units[name])
        for direction in (1, -1):
            while 0 <= level_index + direction < len(LEVELS):
                drifts = {
                    **estimate.noise_levels.process,
                    name: LEVELS[level_index + direction] * units[name],
                }
                noise_levels = dataclasses.replace(estimate.noise_levels, process=drifts)
                trial = evaluate(
                    estimate.candidate, series, noise_levels, estimate.point, estimate.prediction
                )
                if not trial.cost < estimate.cost - MIN_GAIN:
                    break
                estimate, level_index = trial, level_index + direction
    return _line_search_signal_noise(estimate, series)


def _line_search_signal_noise(estimate: Estimate, series: Sequence[SampledRecording]) -> Estimate:
    """Return an estimate with the noise of its inputs, then of each output, scaled by a line
    search.

    The noise stays within `MAX_NOISE_RATIO` of the measured one: a model that lacks physics would
    otherwise rely on the measurements alone.
    """
    measured = measured_noise_levels(series, {})
    for place in range(-1, len(estimate.noise_levels.outputs)):
        for factor in (NOISE_FACTOR, 1.0 / NOISE_FACTOR):
            noise_levels = _scale_noise(estimate.noise_levels, place, factor)
            while _is_near_measured(noise_levels, measured, place):
                trial = evaluate(
                    estimate.candidate, series, noise_levels, estimate.point, estimate.prediction
                )
                if not trial.cost < estimate.cost - MIN_GAIN:
                    break
                estimate, noise_levels = trial, _scale_noise(noise_levels, place, factor)
    return estimate


def _is_near_measured(noise_levels: NoiseLevels, reference: NoiseLevels, channel: int) -> bool:
    """Return whether a noise level is within `MAX_NOISE_RATIO` of the measured one.

    `channel` is the index of an output, or -1 for all inputs.
    """
    now, measured = (
        (noise_levels.inputs, reference.inputs)
        if channel < 0
        else (noise_levels.outputs[channel], reference.outputs[channel])
    )
    ratio = np.max(now / np.maximum(measured, 1e-300), initial=0.0, where=np.asarray(measured) > 0)
    return bool(1.0 / MAX_NOISE_RATIO <= ratio <= MAX_NOISE_RATIO)


def _scale_noise(noise_levels: NoiseLevels, channel: int, factor: float) -> NoiseLevels:
    """Return noise levels with one output scaled, or all inputs for `channel` -1."""
    if channel < 0:
        return dataclasses.replace(noise_levels, inputs=factor * noise_levels.inputs)
    seen = noise_levels.outputs.copy()
    seen[channel] *= factor
    return dataclasses.replace(noise_levels, outputs=seen)


def fit_with_noise(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    units: Mapping[str, float],
    jacobian: Jacobian | None = None,
    nearby: Estimate | None = None,
) -> Estimate:
    """Return parameters and noise levels estimated together from one start.

    The steps are: parameters with fixed levels (`iterate`), a line search of levels, and a joint
    fit (`fit_noise_covariance`). `units` are the disturbances whose level is estimated. `jacobian`
    is an approximate Jacobian near the start, `nearby` an estimate of a similar model. The cost is
    infinite if the model diverges at the start.
    """
    now = iterate(candidate, series, noise_levels, start, jacobian=jacobian, nearby=nearby)
    return fit_noise_covariance(line_search_noise(now, series, units), series, units)


def fit_candidate(
    candidate: Candidate,
    series: Sequence[SampledRecording],
    noise_levels: NoiseLevels,
    start: Mapping[str, float] | ParameterVector,
    units: Mapping[str, float],
    known_cost: float = -np.inf,
    jacobian: Jacobian | None = None,
    nearby: Estimate | None = None,
) -> Estimate:
    """Return the better of fits that start with a small and with the given disturbance level.

    A model must explain data without disturbances; a fit that starts with a large level does not
    get there. The small level is `SMALL_LEVEL` (0.1) units. The second fit is skipped if no given
    level in `units` is larger, or if the first cost is below `known_cost` [nats]. At equal cost the
    first fit is taken.
    """
    small_process = {
        **noise_levels.process,
        **{name: SMALL_LEVEL * unit for name, unit in units.items()},
    }
    small_noise = dataclasses.replace(noise_levels, process=small_process)
    first = fit_with_noise(candidate, series, small_noise, start, units, jacobian, nearby)
    has_small_noise = all(
        noise_levels.process.get(name, 0.0) <= small_process[name] for name in units
    )
    if has_small_noise or first.cost < known_cost:
        return first
    second = fit_with_noise(candidate, series, noise_levels, start, units, jacobian, nearby)
    return min(first, second, key=lambda one: one.cost)


def fit_base(
    candidate: Candidate, series: Sequence[SampledRecording], units: Mapping[str, float]
) -> Estimate:
    """Return the base fitted once to recordings from its declared values, with Huber limits.

    The fit itself has no limits and starts at a level of one unit of each disturbance. The limits
    of the result are `HUBER_STDS` (4) times the robust standard deviation of its innovations; its
    cost and prediction are not computed again with them.
    """
    first = fit_with_noise(candidate, series, measured_noise_levels(series, units), {}, units)
    limits = HUBER_STDS * np.maximum(first.prediction.robust_std(), 1e-12)
    return dataclasses.replace(
        first, noise_levels=dataclasses.replace(first.noise_levels, huber_limits=limits)
    )


def recalibrate(
    first: Estimate, series: Sequence[SampledRecording], units: Mapping[str, float]
) -> Estimate:
    """Return the best of fits of the base from the levels `INITIAL_LEVELS` (0.1, 0.3, 1 units).

    Each fit starts from the point of the best one so far, at first that of `first`. The fits end
    when two in a row differ in cost by less than `MIN_GAIN` (2 nats). `first` is no result.
    """
    fits: list[Estimate] = []
    for level in INITIAL_LEVELS:
        if len(fits) > 1 and abs(fits[-1].cost - fits[-2].cost) < MIN_GAIN:
            break
        drifts = {name: level * unit for name, unit in units.items()}
        known = dataclasses.replace(first.noise_levels, process=drifts)
        best = min(fits, key=lambda one: one.cost, default=first)
        start, columns = best.point, best.jacobian
        fits.append(fit_with_noise(first.candidate, series, known, start, units, columns, best))
    return min(fits, key=lambda one: one.cost)


def _nearest_level(value: float, unit: float) -> int:
    """Return the index in `LEVELS` of the level nearest to a value."""
    return int(np.argmin([abs(level - value / unit) for level in LEVELS]))
