"""Alone: a model that forgets where it started is judged by simulation, with nothing fed back.

A closed loop, a shaft beside a measured speed: what happened long ago does not matter there, so
whole recordings can be simulated. An observer would only take over what such a model misses; and
it does not know when a gap opens. A model that integrates a torque to a speed forgets nothing.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.estimation import estimated
from diagnosis.series import Series, paced
from diagnosis.threshold import Thresholds

SHIFT = 0.01
"""How far states are moved at the start, as a part of their ranges."""
FORGOTTEN = 0.01
"""Part of the largest difference of two runs that may be left in the second half of a recording."""
SIMULATED = Thresholds({}, 30.0, "the usual threshold of whole simulations", modes=1.0)
"""What an effect must gain: what a simulation misses hangs together, so few samples count."""
LEFT_OUT = 0.5
"""Part of it that must be gained left out: what an event shows the rest of a drive may not know."""
PROMISED = 0.1
"""Part of it that a candidate must promise to be fitted: a gap that gains 49 nats promised 7.4."""


@dataclass(frozen=True)
class Alone:
    """A bench without drifts, and the `base` fitted so that it simulates best."""

    bench: Bench
    base: Estimate


def forgets(model: Estimate, series: Sequence[Series]) -> bool:
    """Tell whether a shift of all states at the start is forgotten halfway through recordings."""
    return all(_left(model, one, k) < FORGOTTEN for k, one in enumerate(series))


def _left(model: Estimate, series: Series, recording: int) -> float:
    """Return what is left of a shift in the second half, as a part of its largest effect."""
    candidate, predictor = model.candidate, model.candidate.predictor
    page = candidate.page(model.values(recording), series)
    steady = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.seen)))
    blank = np.full_like(series.measured, np.nan)
    how = candidate.recipe.substeps, series.is_linear
    plain = predictor.predict(page, series.inputs, blank, steady[:0], steady, *how)
    once = blank.copy()
    once[0, 0] = plain.seen[0, 0] + 1.0
    shift = np.zeros((1, *steady.shape[1:]))
    shift[0, :, 0] = SHIFT * candidate.spans
    for name in candidate.drifts:
        shift[0, predictor.states.index(name)] = 0.0
    moved = predictor.predict(page, series.inputs, once, shift, steady, *how)
    if min(plain.done, moved.done) < series.count:
        return float(np.inf)
    apart = np.abs(moved.seen - plain.seen)
    largest = np.max(apart, axis=0)
    late = np.sqrt(np.mean(apart[series.count // 2 :] ** 2, axis=0))
    return float(np.max(late / np.maximum(largest, 1e-300)))


def alone(raw: Bench, base: Estimate) -> Alone:
    """Return the base fitted so that it simulates best; `raw` has the recordings as they are.

    Inputs are held, or run straight between samples: what is better.
    """
    limits = np.full_like(base.noises.limits, np.inf)
    noises = dataclasses.replace(base.noises, drifts={}, limits=limits, is_alone=True)
    found = []
    for is_linear in (True, False):
        series = paced(raw.series, raw.automaton, raw.seen, is_linear)
        own = dataclasses.replace(raw, series=series, drifts=(), _made={})
        candidate = own.candidate(())
        starts: tuple[Mapping[str, float], ...] = (base.values(0), {})
        found += [Alone(own, estimated(candidate, series, noises, start)) for start in starts]
    return min(found, key=lambda one: one.base.cost)
