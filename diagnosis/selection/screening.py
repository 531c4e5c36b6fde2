"""Screening: a few steps of a candidate from each of its starts, with the Jacobian of the base."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from diagnosis.estimation.estimate import Estimate, evaluate, evaluate_near
from diagnosis.estimation.innovations import PredictionResult
from diagnosis.estimation.levenberg_marquardt import (
    SCREENING_ITERATIONS,
    iterate_with_jacobian,
    refresh_gains,
)
from diagnosis.estimation.model_set import ModelSet
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
    the base; the noise levels are those of the base. Phases are set to their best start before and
    after the steps. The result is stored in the fit cache. The cost is infinite if the candidate
    diverges at every start.
    """
    fit = partial(_screen, model_set, base, candidate)
    given = [base.candidate, base.point, base.noise_levels, base.jacobian]
    return model_set.load_or_fit("screened", candidate, given, fit)


def _screen(model_set: ModelSet, base: Estimate, candidate: Candidate) -> Estimate:
    """Return the screening of a candidate without the fit cache."""
    series = model_set.series
    starts: list[Estimate] = []
    near: PredictionResult | None = None
    for values in start_values(candidate, base.values(0)):
        point = extend_vector(candidate, base.candidate, base.point, values)
        here = (
            evaluate_near(candidate, series, base.noise_levels, point, base)
            if near is None
            else evaluate(candidate, series, base.noise_levels, point, near)
        )
        near = here.prediction if here.prediction.is_complete else near
        starts.append(restart_phases(here, series))
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
