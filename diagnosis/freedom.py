"""Freedom: the base with one drift as free as the recordings ask for, all others small."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial

from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_at, looked_like
from diagnosis.estimation import followed
from diagnosis.layers import DRIFT, Layer
from diagnosis.level import FIRST_LEVELS, units_of
from diagnosis.point import extended, point_of
from diagnosis.prediction import Noises
from diagnosis.series import Series

SMALL_LEVEL = FIRST_LEVELS[0]
"""What all drifts have while one of them is let free."""
START_LEVEL = 10.0
WIDE_LEVELS = (1.0, 100.0, 1000.0)
"""Levels from which parameters are fitted: a sensor's error is easily a hundred times its noise."""
NEAR_LEVELS = (3.0, 30.0, 300.0)
"""Levels that are looked at beside, when the parameters are fitted."""
ALL_LEVELS = tuple(sorted((START_LEVEL, *WIDE_LEVELS, *NEAR_LEVELS)))
ROUNDS = 3
"""Rounds in which the parameters are fitted to a freedom: what they have to do is little."""


def freed(bench: Bench, base: Estimate, layer: Layer | None = None) -> Estimate:
    """Return a model with one drift free, its parameters fitted anew; with none, all small.

    They start where the model is, and where they are declared: a base that lacks something may
    have been led far astray.
    """
    known = layer is None or any(layer.id == other.id for other in bench.drifts)
    drifts = bench.drifts if known or layer is None else (*bench.drifts, layer)
    candidate = bench.candidate(base.candidate.layers, drifts)
    make = partial(_freed, bench, base, candidate, layer)
    given = [base.point, base.noises, layer and layer.id]
    return bench.kept("freed", candidate, given, make)


def _freed(bench: Bench, base: Estimate, candidate: Candidate, layer: Layer | None) -> Estimate:
    """Return a candidate with the drift of a layer free, its parameters fitted."""
    name = layer.named(DRIFT) if layer else None
    units = units_of(candidate, bench.series, base.values(0))
    levels = dict.fromkeys(units, SMALL_LEVEL) | ({name: START_LEVEL} if name else {})
    noises = with_levels(base.noises, units, levels)
    found = []
    near = extended(candidate, base.candidate, base.point, {})
    for point in (near, point_of(candidate, len(bench.series), {})):
        now = looked_like(candidate, bench.series, noises, point, base)
        found.append(scanned(now, bench.series, units, name, WIDE_LEVELS))
    now = min(found, key=lambda one: one.cost)
    now = followed(candidate, bench.series, now.noises, now.point, ROUNDS)
    return scanned(now, bench.series, units, name, NEAR_LEVELS)


def scanned(
    now: Estimate,
    series: Sequence[Series],
    units: Mapping[str, float],
    name: str | None,
    levels: Sequence[float],
) -> Estimate:
    """Return an estimate with the level of one drift that foresees best, its parameters held."""
    if name is None:
        return now
    best = now
    for level in levels:
        noises = with_levels(now.noises, units, {name: level})
        tried = looked_at(now.candidate, series, noises, now.point, now.outcome)
        best = tried if tried.cost < best.cost else best
    return best


def with_levels(noises: Noises, units: Mapping[str, float], levels: Mapping[str, float]) -> Noises:
    """Return noises with some drifts at levels, in their units."""
    sizes = {name: level * units[name] for name, level in levels.items()}
    return dataclasses.replace(noises, drifts={**noises.drifts, **sizes})
