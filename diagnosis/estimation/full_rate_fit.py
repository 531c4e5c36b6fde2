"""Full-rate fit: parameters from recordings that are not decimated, with weak priors.

A comparison of models decimates fast recordings, and its priors keep a model near its declared
values. A fit of parameters needs neither: the mean of an input over some samples is not the input,
and a prior biases each parameter that the data determine badly.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording, open_holds
from diagnosis.estimation.estimate import (
    Estimate,
    evaluate,
    evaluate_with_gains_of,
    with_best_gain_scale,
)
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.levenberg_marquardt import estimate_parameters, refine
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.candidate import (
    INITIAL_OFFSET_NAME,
    INITIAL_STD_FRACTION,
    Candidate,
    compile_candidate,
)
from diagnosis.model.parameter import FreeParameter, with_range_prior
from diagnosis.model.parameter_vector import vector_of

OUTPUT_NOISE_FACTORS = (1e-4, 1e-3, 1e-2, 1e-1)
"""Factors of the output noise of the observers by which the starts of fits are found."""
HELD_SUBSTEPS, LINEAR_SUBSTEPS = 2, 4
"""Factors of the number of steps in a sample, for held inputs and for linear ones.

The usual steps have a relative error of up to 3e-4 (`STEP_RATE_PRODUCT`), more than the uncertainty
of a parameter that thousands of samples determine. The predictor holds a linear input at the middle
of a step, so the error is quadratic in the step.
"""

Values = Mapping[str, float]
"""Values [SI] of parameters by name."""


@dataclass(frozen=True)
class FullRateFit:
    """A fit, and the recordings as it predicts them."""

    series: tuple[SampledRecording, ...]
    estimate: Estimate

    @property
    def penalised_cost(self) -> float:
        """The cost [nats] with the penalty of the factor of the gains of an observer."""
        penalty = 0.5 * np.log(max(float(np.sum(self.estimate.prediction.counts)), 1.0))
        is_simulated = self.estimate.noise_levels.is_output_error
        return self.estimate.cost + (0.0 if is_simulated else penalty)

    @property
    def declared(self) -> Estimate:
        """The model with its declared values, for the same recordings."""
        one = self.estimate
        start = vector_of(one.candidate, len(self.series), {})
        return evaluate(one.candidate, self.series, one.noise_levels, start)


def fit_full_rate(
    model_set: ModelSet, base: Estimate, series: Sequence[SampledRecording]
) -> list[FullRateFit]:
    """Return the fits by two noise models, the one of less cost first.

    With the first one the only noise is that of the outputs (an output-error model, Ljung 1999,
    section 4.2), and the initial states of each recording are free. The second one is that of
    `base`, an observer for ordinary disturbances. The observer has one parameter more, the factor
    of its gains, and is the first if it gains more than the penalty of a parameter (Schwarz 1978).
    The fits begin at the declared values, at `base`, and where `_follow_gains` ends. Inputs
    without a known hold have the one of less cost.
    """
    starts: list[Values] = [{}, base.values(0), _follow_gains(base, model_set.series)]
    fits = []
    for is_linear in open_holds(series):
        held = tuple(dataclasses.replace(one, is_first_order_hold=is_linear) for one in series)
        observed = _fit_with_observer(model_set, base, held, starts)
        simulated = _fit_output_error(model_set, held, [*starts, observed.values(0)])
        fits += [FullRateFit(held, observed), FullRateFit(held, simulated)]
    return sorted(fits, key=lambda one: one.penalised_cost)


def _follow_gains(base: Estimate, series: Sequence[SampledRecording]) -> Values:
    """Return the values at the end of a sequence of fits by observers with decreasing gains.

    The output noise of the first observer is a small fraction (`OUTPUT_NOISE_FACTORS`) of that of
    the base, so its states follow the outputs and its modes are those of the machine: the cost has
    few local minima (a continuation method, Allgower and Georg 1990). Each fit begins at the
    values of the fit before it; the first one begins at the declared values.
    """
    limits = np.full_like(base.noise_levels.huber_limits, np.inf)
    candidate = _with_range_priors(base.candidate)
    values: Values = {}
    for factor in OUTPUT_NOISE_FACTORS:
        outputs = factor * base.noise_levels.outputs
        levels = dataclasses.replace(
            base.noise_levels, outputs=outputs, huber_limits=limits, gain_scale=1.0
        )
        values = estimate_parameters(candidate, series, levels, values).values(0)
    return values


def _fit_output_error(
    model_set: ModelSet, series: tuple[SampledRecording, ...], starts: Sequence[Values]
) -> Estimate:
    """Return the best fit of simulations, with an offset of each initial state in each recording.

    The prior of an offset is the noise of its output, as a compared state begins at its first
    measured value, or `INITIAL_STD_FRACTION` of the range of a state that is not compared.
    """
    measured = measured_noise_levels(series, {})
    levels = dataclasses.replace(measured, is_output_error=True, gain_scale=0.0)
    known = dict(zip(model_set.output_names, measured.outputs.tolist(), strict=True))
    states = tuple(one.name for one in model_set.automaton.states.values() if one.type == "real")
    candidate = _compile(model_set, series, states, False)
    columns = candidate.predictor.states
    offsets = {}
    for name in states:
        width = float(candidate.state_ranges[columns.index(name)])
        std = known.get(name, INITIAL_STD_FRACTION * width)
        offsets[INITIAL_OFFSET_NAME.format(name)] = {"low": -width, "high": width, "prior_std": std}
    candidate = _with_parameters(
        candidate,
        [
            dataclasses.replace(one, **offsets.get(one.name, {}))
            for one in candidate.free_parameters
        ],
    )

    def start_of(values: Values) -> Estimate:
        point = vector_of(candidate, len(series), values)
        return evaluate(candidate, series, levels, point)

    begun = sorted((start_of(one) for one in starts), key=lambda one: one.cost)[:2]
    fits = [estimate_parameters(candidate, series, levels, one.point) for one in begun]
    return min(fits, key=lambda one: one.cost)


def _fit_with_observer(
    model_set: ModelSet,
    base: Estimate,
    series: tuple[SampledRecording, ...],
    starts: Sequence[Values],
) -> Estimate:
    """Return the fit by an observer with the noise levels of the base, from the best start."""
    candidate, levels = _compile(model_set, series, (), True), base.noise_levels
    begun = (
        evaluate(candidate, series, levels, vector_of(candidate, len(series), one))
        for one in starts
    )
    best = min(begun, key=lambda one: one.cost)
    fit = estimate_parameters(candidate, series, levels, best.point)
    scaled = with_best_gain_scale(fit, series)
    changed = scaled.noise_levels.gain_scale != fit.noise_levels.gain_scale
    return refine(scaled, series) if changed else fit


def score_first_samples(one: FullRateFit) -> FullRateFit:
    """Return a fit of simulations with all samples scored, if it agrees with the given one.

    The initial states are free, so a simulation needs no burn-in. The fits agree if the samples
    after the burn-in cost at most one nat more for each parameter. Otherwise the machine does not
    start as the model does. The argument is returned then, and for a fit by an observer.
    """
    fit, series = one.estimate, one.series
    if not fit.noise_levels.is_output_error:
        return one
    complete = tuple(dataclasses.replace(recording, burn_in=0.0) for recording in series)
    further = estimate_parameters(fit.candidate, complete, fit.noise_levels, fit.point)
    lost = evaluate_with_gains_of(fit, series, further.point).cost - fit.cost
    own = int(np.sum(fit.candidate.is_per_recording))
    allowed = len(fit.candidate.names) + (len(series) - 1) * own
    return FullRateFit(complete, further) if lost <= allowed else one


def _compile(
    model_set: ModelSet,
    series: Sequence[SampledRecording],
    offset_states: tuple[str, ...],
    has_disturbances: bool,
) -> Candidate:
    """Return the base with weak priors, compiled for recordings.

    It has `HELD_SUBSTEPS` (2) times the usual steps, or `LINEAR_SUBSTEPS` (4) times if an input is
    linear between samples.
    """
    disturbances = model_set.disturbances if has_disturbances else ()
    parts = (model_set.document, model_set.project, (), disturbances, model_set.output_names)
    usual = compile_candidate(*parts, series[0].period, offset_states)
    is_linear = any(np.any(one.linear_inputs) for one in series)
    substeps = (LINEAR_SUBSTEPS if is_linear else HELD_SUBSTEPS) * usual.compiled.substeps
    candidate = compile_candidate(*parts, series[0].period, offset_states, substeps)
    return _with_range_priors(dataclasses.replace(candidate, magnitudes=model_set.magnitudes))


def _with_range_priors(candidate: Candidate) -> Candidate:
    """Return a candidate in which each parameter has the prior of its range."""
    return _with_parameters(
        candidate,
        [one if one.per_recording else with_range_prior(one) for one in candidate.free_parameters],
    )


def _with_parameters(candidate: Candidate, parameters: Sequence[FreeParameter]) -> Candidate:
    """Return a candidate with other priors of its free parameters."""
    compiled = dataclasses.replace(candidate.compiled, free_parameters=tuple(parameters))
    return dataclasses.replace(candidate, compiled=compiled)
