"""Screening: a few steps of a candidate from each of its starts, with the Jacobian of the base."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import partial

from diagnosis.estimation.estimate import Estimate, evaluate_near, with_best_gain_scale
from diagnosis.estimation.levenberg_marquardt import (
    SCREENING_ITERATIONS,
    iterate_with_jacobian,
    refresh_gains,
)
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.path_spectrum import strongest_orders
from diagnosis.estimation.per_recording_parameters import restart_phases
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import extend_vector

MAX_STARTS = 2
"""Starts of a candidate from which steps are made, those of least cost."""
HALVING_ITERATIONS = 2
"""Steps from each of them, after which the better one is continued alone."""


def screen_candidate(model_set: ModelSet, base: Estimate, candidate: Candidate) -> Estimate:
    """Return a candidate after a few steps from the best of its starts.

    The parameters of the base start at their values there, and their Jacobian columns are those of
    the base; the noise levels are those of the base, but a base that lacks physics may need larger
    Kalman gains than the candidate. Phases are set to their best start before and
    after the steps. The Kalman gains do not know of a delay, so with one their factor is chosen at
    each start. The result is stored in the fit cache. The cost is infinite if the candidate
    diverges at every start.
    """
    fit = partial(_screen, model_set, base, candidate)
    given = [base.candidate, base.point, base.noise_levels, base.jacobian]
    return model_set.load_or_fit("screened", candidate, given, fit)


def _screen(model_set: ModelSet, base: Estimate, candidate: Candidate) -> Estimate:
    """Return the screening of a candidate without the fit cache."""
    series, levels = model_set.series, base.noise_levels
    levels = dataclasses.replace(levels, gain_scale=min(levels.gain_scale, 1.0))
    starts = []
    given = start_values(candidate, base.values(0))
    for values in _with_orders(model_set, base, candidate, given):
        point = extend_vector(candidate, base.candidate, base.point, values)
        here = evaluate_near(candidate, series, levels, point, base)
        if candidate.compiled.delays:
            here = with_best_gain_scale(here, series)
        starts.append(min(here, restart_phases(here, series), key=lambda one: one.cost))
    starts.sort(key=lambda one: one.cost)
    halved = [
        iterate_with_jacobian(one, series, base.jacobian, HALVING_ITERATIONS)
        for one in starts[:MAX_STARTS]
    ]
    best = min(halved, key=lambda one: one.cost)
    rest = SCREENING_ITERATIONS - HALVING_ITERATIONS
    best = refresh_gains(iterate_with_jacobian(best, series, base.jacobian, rest), series)
    again = restart_phases(best, series)
    if again is best or not again.cost < best.cost:
        return best
    again = iterate_with_jacobian(again, series, base.jacobian, SCREENING_ITERATIONS)
    return refresh_gains(again, series)


def _with_orders(
    model_set: ModelSet, base: Estimate, candidate: Candidate, starts: list[dict[str, float]]
) -> list[dict[str, float]]:
    """Return starts in which an order is the plain one or that of a strong period of innovations.

    The innovations are those of the base. The path is the first state that the candidate adds.
    Without an order, or if the path does not move, the starts are returned.
    """
    orders = [one for one in candidate.free_parameters if one.is_order and one.name in starts[0]]
    paths = [
        name for name in candidate.predictor.states if name not in base.candidate.predictor.states
    ]
    if not orders or not paths:
        return starts
    point = extend_vector(candidate, base.candidate, base.point, starts[0])
    here = evaluate_near(candidate, model_set.series, base.noise_levels, point, base)
    if not here.prediction.is_complete:
        return starts
    column = candidate.predictor.states.index(paths[0])
    found = strongest_orders(
        [run.states[:, column] for run in here.prediction.predictions],
        [run.innovations for run in base.prediction.predictions],
        orders[0].low,
        orders[0].high,
    )
    if found and orders[0].plain is not None:
        found = (orders[0].plain, *found)
    return [{**starts[0], orders[0].name: order} for order in found] or starts


def start_values(candidate: Candidate, base: Mapping[str, float]) -> list[dict[str, float]]:
    """Return the starts of a candidate's fit: values [SI] of the parameters that the base lacks.

    The number of starts is the largest number of any shared parameter; shorter lists repeat their
    last value.
    """
    own = [one for one in candidate.free_parameters if one.name not in base]
    count = max((len(one.starts) for one in own if not one.per_recording), default=1)
    return [
        {one.name: one.starts[min(k, len(one.starts) - 1)] for one in own} for k in range(count)
    ]
