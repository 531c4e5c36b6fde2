"""Full-rate fit: parameters from recordings that are not decimated, with weak priors.

A comparison of models decimates fast recordings and has priors that keep a model near its declared
values. A fit of parameters needs neither: decimated inputs are wrong between two samples, and a
prior biases every parameter that the data determine badly.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording, open_holds
from diagnosis.estimation.estimate import Estimate, with_best_gain_scale
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.levenberg_marquardt import estimate_parameters, refine
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.candidate import INITIAL_OFFSET_NAME, Candidate, compile_candidate
from diagnosis.model.parameter import FreeParameter, with_range_prior


def fit_full_rate(
    model_set: ModelSet, base: Estimate, series: Sequence[SampledRecording]
) -> tuple[tuple[SampledRecording, ...], Estimate]:
    """Return the recordings as they are predicted, and the better fit of two noise models.

    With the first one the only noise is that of the outputs (an output-error model, Ljung 1999,
    section 4.2), and the initial states of each recording are free. The second one is that of
    `base`, an observer for ordinary disturbances. The observer has one parameter more, the factor
    of its gains, and is chosen if it gains more than the penalty of a parameter (Schwarz 1978). The
    fits begin at `base` and at the declared values. Inputs without a known hold have the one of
    less cost.
    """
    fits = [
        (held, fit)
        for is_linear in open_holds(series)
        for held in [_with_hold(series, is_linear)]
        for fit in (
            _fit_output_error(model_set, base, held),
            _fit_with_observer(model_set, base, held),
        )
    ]
    return min(fits, key=lambda one: _penalised_cost(one[1]))


def _with_hold(
    series: Sequence[SampledRecording], is_linear: bool
) -> tuple[SampledRecording, ...]:
    """Return recordings with the hold of inputs that have none."""
    return tuple(dataclasses.replace(one, is_first_order_hold=is_linear) for one in series)


def _penalised_cost(fit: Estimate) -> float:
    """Return the cost [nats] of a fit with the penalty of the factor of its gains."""
    penalty = 0.5 * np.log(max(float(np.sum(fit.prediction.counts)), 1.0))
    return fit.cost + (0.0 if fit.noise_levels.is_output_error else penalty)


def _fit_output_error(
    model_set: ModelSet, base: Estimate, series: tuple[SampledRecording, ...]
) -> Estimate:
    """Return the fit of simulations, with an offset of each initial state in each recording.

    The prior of an offset is the noise of its output, as a compared state begins at its first
    measured value, or `INITIAL_STD_FRACTION` of the range of a state that is not compared.
    """
    measured = measured_noise_levels(series, {})
    levels = dataclasses.replace(measured, is_output_error=True, gain_scale=0.0)
    names = model_set.output_names
    noise = {
        INITIAL_OFFSET_NAME.format(name): float(std)
        for name, std in zip(names, measured.outputs, strict=True)
    }
    candidate = compile_candidate(
        model_set.document,
        model_set.project,
        (),
        (),
        names,
        series[0].period,
        tuple(model_set.automaton.states),
    )
    offsets = {
        one.name: dataclasses.replace(one, prior_std=noise.get(one.name, one.prior_std))
        for one in candidate.free_parameters
        if one.per_recording
    }
    candidate = _with_parameters(
        candidate,
        [offsets.get(one.name) or with_range_prior(one) for one in candidate.free_parameters],
    )
    starts = ({}, base.values(0))
    fits = [estimate_parameters(candidate, series, levels, start) for start in starts]
    return min(fits, key=lambda one: one.cost)


def _fit_with_observer(
    model_set: ModelSet, base: Estimate, series: tuple[SampledRecording, ...]
) -> Estimate:
    """Return the fit by an observer with the noise levels of the base."""
    own = dataclasses.replace(model_set, series=series, _compiled={})
    compiled = own.compile_candidate(())
    candidate = _with_parameters(compiled, [with_range_prior(p) for p in compiled.free_parameters])
    fit = estimate_parameters(candidate, series, base.noise_levels, base.values(0))
    scaled = with_best_gain_scale(fit, series)
    changed = scaled.noise_levels.gain_scale != fit.noise_levels.gain_scale
    return refine(scaled, series) if changed else fit


def _with_parameters(candidate: Candidate, parameters: Sequence[FreeParameter]) -> Candidate:
    """Return a candidate with other priors of its free parameters."""
    compiled = dataclasses.replace(candidate.compiled, free_parameters=tuple(parameters))
    return dataclasses.replace(candidate, compiled=compiled)
