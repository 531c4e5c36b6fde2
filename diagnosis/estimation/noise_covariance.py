"""Noise covariance: joint maximum-likelihood estimation of noise levels and parameters.

Parameters and noise levels depend on each other. Estimated in turns they stop at points hundreds of
nats above the joint optimum.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, evaluate
from diagnosis.estimation.innovations import (
    INPUT_NOISE_NAME,
    OUTPUT_NOISE_NAME,
    PROCESS_NOISE_NAME,
    NoiseLevels,
    measured_noise_levels,
    noise_levels_at,
)
from diagnosis.estimation.levenberg_marquardt import refine
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter import FreeParameter
from diagnosis.model.parameter_vector import ParameterVector

MIN_LEVEL, MAX_LEVEL = 0.03, 3.0
"""Range of a disturbance's standard deviation, in its unit, while effects are selected."""
NO_LEVEL_BOUNDS: Mapping[str, float] = {}
MAX_NOISE_RATIO = 2.5
"""Largest factor between an estimated noise level and the measured one."""
PROCESS_NOISE_PRIOR, MEASURED_NOISE_PRIOR = 2.0, 0.5
"""Prior standard deviations of the logarithms: wide for disturbances, narrow for measured noise."""


def fit_noise_covariance(
    estimate: Estimate,
    series: Sequence[SampledRecording],
    units: Mapping[str, float],
    max_levels: Mapping[str, float] = NO_LEVEL_BOUNDS,
) -> Estimate:
    """Return a fit with parameters and noise levels at their joint optimum.

    Only disturbances in `units` [SI] are estimated, from `MIN_LEVEL` up to `max_levels` (in units,
    `MAX_LEVEL` = 3 by default), and the noise of outputs and inputs within `MAX_NOISE_RATIO` (2.5)
    of the measured noise. With the output-error criterion, or if the joint fit diverges or is not
    better, only the parameters are refined. The result has no noise parameters.
    """
    if estimate.noise_levels.is_output_error or not np.isfinite(estimate.cost):
        return refine(estimate, series)
    measured = measured_noise_levels(series, {})
    levels = tuple(_noise_parameters(estimate.candidate, measured, units, max_levels))
    extended = dataclasses.replace(estimate.candidate, noise_parameters=levels)
    point = _append_noise_parameters(extended, estimate)
    noise_levels = noise_levels_at(extended, point, estimate.noise_levels)
    initial = evaluate(extended, series, noise_levels, point, estimate.prediction)
    if not np.isfinite(initial.cost):
        return refine(estimate, series)
    fitted = _drop_noise_parameters(estimate.candidate, refine(initial, series))
    return fitted if fitted.cost < estimate.cost else refine(estimate, series)


def _noise_parameters(
    candidate: Candidate,
    reference: NoiseLevels,
    units: Mapping[str, float],
    max_levels: Mapping[str, float],
) -> Iterator[FreeParameter]:
    """Yield the noise levels to estimate: disturbances in `units`, outputs, and one factor for
    inputs.

    Levels of outputs and inputs are near `reference`; those that are 0 there are left out.
    """
    for name, unit in units.items():
        geometric_mean = unit * np.sqrt(MIN_LEVEL * MAX_LEVEL)
        high = max_levels.get(name, MAX_LEVEL) * unit
        yield _noise_parameter(
            PROCESS_NOISE_NAME.format(name),
            geometric_mean,
            MIN_LEVEL * unit,
            high,
            PROCESS_NOISE_PRIOR,
        )
    noise_levels = {
        OUTPUT_NOISE_NAME.format(n): v
        for n, v in zip(candidate.predictor.outputs, reference.outputs, strict=True)
    }
    noise_levels[INPUT_NOISE_NAME] = float(np.max(reference.inputs, initial=0.0))
    for name, noise in noise_levels.items():
        if noise > 0.0:
            yield _noise_parameter(
                name, noise, noise / MAX_NOISE_RATIO, noise * MAX_NOISE_RATIO, MEASURED_NOISE_PRIOR
            )


def _noise_parameter(
    name: str, value: float, low: float, high: float, prior_std: float
) -> FreeParameter:
    """Return a noise level as a free parameter with a logarithmic coordinate."""
    return FreeParameter(name, float(value), float(low), float(high), prior_std, True)


def _append_noise_parameters(extended: Candidate, estimate: Estimate) -> ParameterVector:
    """Return the point of an estimate with its noise levels appended, clipped to their ranges."""
    noise_levels = estimate.noise_levels
    values = {
        PROCESS_NOISE_NAME.format(name): level for name, level in noise_levels.process.items()
    }
    seen = zip(extended.predictor.outputs, noise_levels.outputs, strict=True)
    values |= {OUTPUT_NOISE_NAME.format(name): float(noise) for name, noise in seen}
    values[INPUT_NOISE_NAME] = float(np.max(noise_levels.inputs, initial=0.0))
    z = np.array([
        one.coordinate(min(max(values.get(one.name, 0.0), one.low), one.high))
        for one in extended.noise_parameters
    ])  # fmt: skip
    own = np.tile(z, (len(estimate.point.per_recording), 1))
    return ParameterVector(
        np.append(estimate.point.shared, z), np.hstack([estimate.point.per_recording, own])
    )


def _drop_noise_parameters(candidate: Candidate, extended: Estimate) -> Estimate:
    """Return an estimate without its noise parameters as coordinates;
    their values stay in its levels.
    """
    count = len(candidate.free_parameters)
    point = ParameterVector(
        extended.point.shared[:count].copy(), extended.point.per_recording[:, :count].copy()
    )
    columns = {name: extended.jacobian[name] for name in candidate.names}
    normal = extended.normal_equations and dataclasses.replace(
        extended.normal_equations,
        a=np.ascontiguousarray(extended.normal_equations.a[:, :count, :count]),
        g=np.ascontiguousarray(extended.normal_equations.g[:, :count]),
        own=extended.normal_equations.own[:count],
    )
    cost = extended.prediction.negative_log_likelihood() + point.prior_cost(candidate)
    return dataclasses.replace(
        extended,
        candidate=candidate,
        point=point,
        cost=cost,
        normal_equations=normal,
        jacobian=columns,
    )
