"""Inter-sample behaviour: the base fitted with held and with linear inputs, and the better one.

A base that lacks physics often chooses the wrong one, because half a sample is a delay as well. The
choice is therefore made by fits in which a disturbance of a balance is free.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np

from diagnosis.data.sampled_recording import (
    SampledRecording,
    UnusableRecordingError,
    open_holds,
    resample,
)
from diagnosis.estimation.estimate import Estimate, with_best_gain_scale
from diagnosis.estimation.initial_input import average_initial_inputs, choose_initial_inputs
from diagnosis.estimation.innovations import measured_noise_levels
from diagnosis.estimation.levenberg_marquardt import estimate_parameters, refine
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import HUBER_STDS, ORDINARY_LEVEL, disturbance_units
from diagnosis.estimation.place_scale import with_scales
from diagnosis.localisation.disturbance_state_fit import free_disturbance
from diagnosis.model.candidate import Candidate

LogCallback = Callable[[str], None]
FittedBase = tuple[ModelSet, Estimate]


def fit_base(model_set: ModelSet, log: LogCallback = lambda text: None) -> FittedBase:
    """Return the model set with decimated recordings and the base fitted to them.

    The noise of the signals is the measured one, and each balance has an ordinary disturbance of
    `ORDINARY_LEVEL` (0.1 units); these levels are held. Inputs without a known hold are linear or
    constant between samples, whichever costs less with the best free disturbance of a balance.
    Huber limits are `HUBER_STDS` (4) robust standard deviations of the innovations of a first fit
    without limits. Raises UnusableRecordingError if the model cannot be linearised or diverges.
    """
    by_hold = [_fit_with_hold(model_set, is_linear) for is_linear in open_holds(model_set.series)]
    paced, first = min(by_hold, key=_flexible_cost)
    limits = HUBER_STDS * np.maximum(first.prediction.robust_std(), 1e-12)
    noise_levels = dataclasses.replace(first.noise_levels, huber_limits=limits)
    fit = partial(estimate_parameters, first.candidate, paced.series, noise_levels, first.point)
    fitted = paced.load_or_fit("base", first.candidate, [first.point, noise_levels], fit)
    base = with_best_gain_scale(fitted, paced.series)
    if base.noise_levels.gain_scale < 1.0:
        again = partial(refine, base, paced.series)
        base = paced.load_or_fit("scaled base", base.candidate, [base.point, base.gains], again)
    if not np.isfinite(base.cost):
        raise UnusableRecordingError(_describe_divergence(paced, base))
    log(f"base fitted, {_describe_holds(paced)}: {base.cost:.0f} nats")
    return with_scales(paced, base), base


def _describe_divergence(model_set: ModelSet, base: Estimate) -> str:
    """Return on which recording a model diverges first, and when, in words."""
    name, runs = model_set.automaton.name, base.prediction.predictions
    for one, run in zip(model_set.series, runs, strict=True):
        if run.completed < one.count:
            time = float(one.start + run.completed * one.period)
            return f"{one.name}: `{name}` diverges at {time:.4g} s of this recording"
    return f"the errors of `{name}` are beyond the largest number"


def _describe_holds(model_set: ModelSet) -> str:
    """Return which inputs are linear between samples, in words."""
    linear = np.any([one.linear_inputs for one in model_set.series], axis=0)
    names = [name for name, one in zip(model_set.automaton.inputs, linear, strict=True) if one]
    return f"linear between samples: {', '.join(names)}" if names else "inputs held"


def _fit_with_hold(model_set: ModelSet, is_linear: bool) -> FittedBase:
    """Return the model set with one inter-sample behaviour and a first fit of the base."""
    series = resample(model_set.series, model_set.automaton, model_set.output_names, is_linear)
    averaged = tuple(average_initial_inputs(one) for one in series)
    paced = dataclasses.replace(model_set, series=averaged)
    disturbances = tuple(paced.scale_disturbance(one) for one in model_set.disturbances)
    paced = dataclasses.replace(paced, disturbances=disturbances)
    candidate = paced.compile_candidate(())
    fit = partial(_first_fit, candidate, averaged)
    first = paced.load_or_fit("first fit", candidate, [], fit)
    return dataclasses.replace(paced, series=choose_initial_inputs(first, averaged)), first


def _first_fit(candidate: Candidate, series: tuple[SampledRecording, ...]) -> Estimate:
    """Return the base fitted from its declared values, without Huber limits."""
    units = disturbance_units(candidate, series, {})
    ordinary = {name: ORDINARY_LEVEL * unit for name, unit in units.items()}
    return estimate_parameters(candidate, series, measured_noise_levels(series, ordinary), {})


def _flexible_cost(fitted: FittedBase) -> float:
    """Return the least cost [nats] of a base in which one balance has a free disturbance."""
    model_set, first = fitted
    costs = [free_disturbance(model_set, first, one).cost for one in model_set.disturbances]
    return min(costs, default=first.cost)
