"""Disturbance state fit: a fit of the base with a large process-noise level at one place only."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, evaluate, evaluate_near
from diagnosis.estimation.innovations import NoiseLevels
from diagnosis.estimation.levenberg_marquardt import iterate_broyden
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import ORDINARY_LEVEL, disturbance_units
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import extend_vector, vector_of
from diagnosis.model.placed_effect import DISTURBANCE_STATE, PlacedEffect

INITIAL_LEVEL = 10.0
WIDE_LEVELS = (1.0, 100.0, 1000.0)
"""Levels tried before the parameters are fitted: a sensor error can be 100 times its noise."""
NEAR_LEVELS = (3.0, 30.0, 300.0)
"""Levels that are tried after the parameters are fitted."""
ALL_LEVELS = tuple(sorted((INITIAL_LEVEL, *WIDE_LEVELS, *NEAR_LEVELS)))
MAX_ITERATIONS = 3
"""Iterations of the parameters; their changes are small."""


def free_disturbance(
    model_set: ModelSet, base: Estimate, placed_effect: PlacedEffect | None = None
) -> Estimate:
    """Return the model with the disturbance of `placed_effect` free and its parameters fitted.

    Other disturbances (with None all) stay at `ORDINARY_LEVEL`; the level is the best of
    `WIDE_LEVELS` and `INITIAL_LEVEL`, then of `NEAR_LEVELS`. The fit starts from the better of base
    and declared parameters, takes at most `MAX_ITERATIONS` (3) steps and is cached. The cost is
    infinite if it diverges.
    """
    drifts = model_set.disturbances
    if placed_effect is not None and placed_effect.id not in {one.id for one in drifts}:
        drifts = (*drifts, placed_effect)
    candidate = model_set.compile_candidate(base.candidate.placed_effects, drifts)
    fit = partial(_fit_free_disturbance, model_set, base, candidate, placed_effect)
    dependencies = [base.point, base.noise_levels, placed_effect and placed_effect.id]
    return model_set.load_or_fit("freed", candidate, dependencies, fit)


def _fit_free_disturbance(
    model_set: ModelSet, base: Estimate, candidate: Candidate, placed_effect: PlacedEffect | None
) -> Estimate:
    """Return the fit of a candidate with the disturbance of `placed_effect` free."""
    name = placed_effect.qualified_name(DISTURBANCE_STATE) if placed_effect else None
    units = disturbance_units(candidate, model_set.series, base.values(0))
    levels = dict.fromkeys(units, ORDINARY_LEVEL) | ({name: INITIAL_LEVEL} if name else {})
    whole_gains = dataclasses.replace(base.noise_levels, gain_scale=1.0)
    noise_levels = with_disturbance_levels(whole_gains, units, levels)
    scans = []
    start = extend_vector(candidate, base.candidate, base.point, {})
    for point in (start, vector_of(candidate, len(model_set.series), {})):
        now = evaluate_near(candidate, model_set.series, noise_levels, point, base)
        scans.append(scan_level(now, model_set.series, units, name, WIDE_LEVELS))
    now = min(scans, key=lambda one: one.cost)
    now = iterate_broyden(candidate, model_set.series, now.noise_levels, now.point, MAX_ITERATIONS)
    return scan_level(now, model_set.series, units, name, NEAR_LEVELS)


def scan_level(
    estimate: Estimate,
    series: Sequence[SampledRecording],
    units: Mapping[str, float],
    name: str | None,
    levels: Sequence[float],
) -> Estimate:
    """Return the estimate with the best level [units] of one disturbance, parameters fixed."""
    if name is None:
        return estimate
    best = estimate
    for level in levels:
        noise_levels = with_disturbance_levels(estimate.noise_levels, units, {name: level})
        point, near = estimate.point, estimate.prediction
        tried = evaluate(estimate.candidate, series, noise_levels, point, near)
        best = tried if tried.cost < best.cost else best
    return best


def with_disturbance_levels(
    noise_levels: NoiseLevels, units: Mapping[str, float], levels: Mapping[str, float]
) -> NoiseLevels:
    """Return noise levels in which `levels` are multiples of `units`; others stay."""
    sizes = {name: level * units[name] for name, level in levels.items()}
    return dataclasses.replace(noise_levels, process={**noise_levels.process, **sizes})
