"""Freedom: the base with one drift as free as the recordings ask for, all others small."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, evaluate, evaluate_near
from diagnosis.estimation.innovations import NoiseLevels
from diagnosis.estimation.levenberg_marquardt import iterate_broyden
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import INITIAL_LEVELS, disturbance_units
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import extend_vector, vector_of
from diagnosis.model.placed_effect import DISTURBANCE_STATE, PlacedEffect

SMALL_LEVEL = INITIAL_LEVELS[0]
"""What all drifts have while one of them is let free."""
INITIAL_LEVEL = 10.0
WIDE_LEVELS = (1.0, 100.0, 1000.0)
"""Levels from which parameters are fitted: a sensor's error is easily a hundred times its noise."""
NEAR_LEVELS = (3.0, 30.0, 300.0)
"""Levels that are looked at beside, when the parameters are fitted."""
ALL_LEVELS = tuple(sorted((INITIAL_LEVEL, *WIDE_LEVELS, *NEAR_LEVELS)))
MAX_ITERATIONS = 3
"""Rounds in which the parameters are fitted to a freedom: what they have to do is little."""


def free_disturbance(
    model_set: ModelSet, base: Estimate, placed_effect: PlacedEffect | None = None
) -> Estimate:
    """Return a model with one drift free, its parameters fitted anew; with none, all small.

    They start where the model is, and where they are declared: a base that lacks something may
    have been led far astray.
    """
    known = placed_effect is None or any(
        placed_effect.id == other.id for other in model_set.disturbances
    )
    drifts = (
        model_set.disturbances
        if known or placed_effect is None
        else (*model_set.disturbances, placed_effect)
    )
    candidate = model_set.compile_candidate(base.candidate.placed_effects, drifts)
    make = partial(_fit_free_disturbance, model_set, base, candidate, placed_effect)
    given = [base.point, base.noise_levels, placed_effect and placed_effect.id]
    return model_set.load_or_fit("freed", candidate, given, make)


def _fit_free_disturbance(
    model_set: ModelSet, base: Estimate, candidate: Candidate, placed_effect: PlacedEffect | None
) -> Estimate:
    """Return a candidate with the drift of a layer free, its parameters fitted."""
    name = placed_effect.qualified_name(DISTURBANCE_STATE) if placed_effect else None
    units = disturbance_units(candidate, model_set.series, base.values(0))
    levels = dict.fromkeys(units, SMALL_LEVEL) | ({name: INITIAL_LEVEL} if name else {})
    noise_levels = with_disturbance_levels(base.noise_levels, units, levels)
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
    """Return an estimate with the level of one drift that foresees best, its parameters held."""
    if name is None:
        return estimate
    best = estimate
    for level in levels:
        noise_levels = with_disturbance_levels(estimate.noise_levels, units, {name: level})
        tried = evaluate(
            estimate.candidate, series, noise_levels, estimate.point, estimate.prediction
        )
        best = tried if tried.cost < best.cost else best
    return best


def with_disturbance_levels(
    noise_levels: NoiseLevels, units: Mapping[str, float], levels: Mapping[str, float]
) -> NoiseLevels:
    """Return noises with some drifts at levels, in their units."""
    sizes = {name: level * units[name] for name, level in levels.items()}
    return dataclasses.replace(noise_levels, process={**noise_levels.process, **sizes})
