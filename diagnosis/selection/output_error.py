"""Output error: the criterion of free simulation, for models with fading memory.

Examples are a closed loop, or a shaft beside a measured speed: the initial state is forgotten, so
whole recordings can be simulated. An observer would absorb the errors of such a model, and does not
know when a gap opens. A model that integrates a torque to a speed has no fading memory.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording, open_holds, resample
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.place_scale import with_scales

INITIAL_SHIFT = 0.01
"""How far states are moved at the start, as a part of their ranges."""
MAX_REMAINING_SHIFT = 0.01
"""Part of the largest difference of two runs that may be left in the second half of a recording."""


@dataclass(frozen=True)
class OutputErrorFit:
    """A model set without disturbances, and the base fitted by the output-error criterion."""

    model_set: ModelSet
    base: Estimate


def has_fading_memory(model: Estimate, series: Sequence[SampledRecording]) -> bool:
    """Return whether a shift of all initial states has decayed halfway through each recording."""
    return all(
        _remaining_shift(model, one, k) < MAX_REMAINING_SHIFT for k, one in enumerate(series)
    )


def _remaining_shift(model: Estimate, series: SampledRecording, recording: int) -> float:
    """Return what is left of a shift in the second half, as a part of its largest effect."""
    candidate, predictor = model.candidate, model.candidate.predictor
    page = candidate.calibration_page(model.values(recording), series)
    steady = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.outputs)))
    blank = np.full_like(series.measured, np.nan)
    how = candidate.compiled.substeps, series.linear_inputs
    plain = predictor.predict(page, series.inputs, blank, steady[:0], steady, *how)
    once = blank.copy()
    once[0, 0] = plain.outputs[0, 0] + 1.0
    shift = np.zeros((1, *steady.shape[1:]))
    shift[0, :, 0] = INITIAL_SHIFT * candidate.state_ranges
    for name in candidate.disturbance_states:
        shift[0, predictor.states.index(name)] = 0.0
    moved = predictor.predict(page, series.inputs, once, shift, steady, *how)
    if min(plain.completed, moved.completed) < series.count:
        return float(np.inf)
    apart = np.abs(moved.outputs - plain.outputs)
    largest = np.max(apart, axis=0)
    late = np.sqrt(np.mean(apart[series.count // 2 :] ** 2, axis=0))
    return float(np.max(late / np.maximum(largest, 1e-300)))


def fit_output_error(full_rate_set: ModelSet, base: Estimate) -> OutputErrorFit:
    """Return the base fitted by the output-error criterion to the recordings, decimated if
    possible.

    It is the best of both inter-sample behaviours, from the fitted and the declared parameters.
    """
    limits = np.full_like(base.noise_levels.huber_limits, np.inf)
    noise_levels = dataclasses.replace(
        base.noise_levels, process={}, huber_limits=limits, is_output_error=True, gain_scale=1.0
    )
    found = []
    for is_linear in open_holds(full_rate_set.series):
        series = resample(
            full_rate_set.series, full_rate_set.automaton, full_rate_set.output_names, is_linear
        )
        own = dataclasses.replace(full_rate_set, series=series, disturbances=(), _compiled={})
        candidate = own.compile_candidate(())
        starts: tuple[Mapping[str, float], ...] = (base.values(0), {})
        found += [
            OutputErrorFit(own, estimate_parameters(candidate, series, noise_levels, start))
            for start in starts
        ]
    best = min(found, key=lambda one: one.base.cost)
    return OutputErrorFit(with_scales(best.model_set, best.base), best.base)
