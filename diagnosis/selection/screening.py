"""Screening: gains of candidates after few steps, on some recordings first, then on all."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, evaluate, evaluate_near, evaluate_with_gains_of
from diagnosis.estimation.innovations import PredictionResult
from diagnosis.estimation.levenberg_marquardt import (
    SCREENING_ITERATIONS,
    iterate_with_jacobian,
    refresh_gains,
)
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.per_recording_parameters import restart_phases
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, extend_vector
from diagnosis.model.placed_effect import PlacedEffect

SCREENED_FRACTION, MIN_SCREENED, MAX_SCREENED = 1 / 3, 3, 5
"""The part of the recordings that candidates are screened on first, spread over all, and how many
these are at least and at most."""
MAX_FULL_SCREENINGS = 10
"""Candidates that are then screened on all, those that gained most; and as many again at most that
the others alone may show."""
MIN_SCREENING_GAIN = 2.0
"""Nats that a candidate gains at least, if it is to be looked at further."""
MAX_START_LOSS = 100.0
"""Nats: a start that loses as much on some recordings gains nothing on all."""
MAX_STARTS, MAX_STARTS_BESIDE = 2, 1
"""Starts of a candidate from which steps are made, the best ones: alone, and beside what was
accepted, where a second one was hardly ever better."""
HALVING_ITERATIONS = 2
"""Steps from each of them; then the better one goes on alone."""
STRONG_GAIN = 2000.0
"""Nats that one candidate gains after these steps from which on others are held against it."""
MIN_BEST_FRACTION = 0.02
"""Part of what the best one gains that another has to gain to go on: none was seen to overtake one
so far ahead, and what is weak is looked for again beside what is strong."""
CompiledEffect = tuple[PlacedEffect, Candidate]
FittedValues = Mapping[str, Mapping[str, float]]
"""What an effect's own parameters were where it was fitted alone, by its layer."""
One = TypeVar("One")


@dataclass(frozen=True)
class ScreeningResult:
    """The screening gain [nats] of a candidate, and its estimate;
    None if not screened on all recordings.
    """

    placed_effect: PlacedEffect
    gain: float
    start: Estimate | None = field(default=None, repr=False)


@dataclass(frozen=True)
class ScreeningSubset:
    """A subset of recordings (`rows` of the model set) as a model set with its base.

    `fitted_values` are further starts of candidates.
    """

    rows: list[int]
    model_set: ModelSet
    base: Estimate = field(repr=False)
    fitted_values: FittedValues = field(default_factory=dict, repr=False)

    def point(self, whole: ParameterVector) -> ParameterVector:
        """Return the part of a point of all recordings for this subset."""
        return ParameterVector(whole.shared, whole.per_recording[self.rows])


def screen_candidates(
    model_set: ModelSet,
    base: Estimate,
    compiled: Sequence[CompiledEffect],
    min_gain: float,
    fitted_values: FittedValues | None = None,
) -> list[ScreeningResult]:
    """Return the screening results of candidates, the largest gain first.

    A candidate that gains at least `min_gain` [nats] on the subset is screened on all recordings,
    unless many gain more. Candidates start also at `fitted_values`.
    """
    some, fair = (
        screening_subset(model_set, base, fitted_values or {}),
        _reference_cost(base, model_set.series),
    )
    begun = [
        (placed_effect, _screen_starts(some, candidate)) for placed_effect, candidate in compiled
    ]
    ahead, behind = _split_by_gain(begun, lambda one: some.base.cost - one.cost)
    hints = [
        (placed_effect, _screen_on_subset(model_set, some, one, base, min_gain))
        for placed_effect, one in ahead
    ]
    near, far = _split_by_gain(hints, lambda hint: hint.gain)
    found = [
        ScreeningResult(placed_effect, some.base.cost - one.cost) for placed_effect, one in behind
    ]
    found += [ScreeningResult(placed_effect, hint.gain) for placed_effect, hint in far]
    places = {True: 0, False: 0}
    for placed_effect, hint in sorted(near, key=lambda one: -one[1].gain):
        places[hint.is_shown_by_subset] += 1
        start = None
        if hint.gain >= min_gain and places[hint.is_shown_by_subset] <= MAX_FULL_SCREENINGS:
            start = _screen_on_all(model_set, some, base, hint)
        gain = hint.gain if start is None else fair - start.cost
        found.append(ScreeningResult(placed_effect, gain, start))
    return sorted(found, key=lambda one: -one.gain)


def _split_by_gain(
    candidates: Sequence[tuple[PlacedEffect, One]], gain: Callable[[One], float]
) -> tuple[list[tuple[PlacedEffect, One]], list[tuple[PlacedEffect, One]]]:
    """Return candidates that are near the best one by what they `gain` [nats], and the others."""
    gains = [gain(one) for _, one in candidates]
    most = max(gains, default=0.0)
    least = MIN_BEST_FRACTION * most if most > STRONG_GAIN else -np.inf
    return (
        [pair for pair, each in zip(candidates, gains, strict=True) if each >= least],
        [pair for pair, each in zip(candidates, gains, strict=True) if not each >= least],
    )


def screening_subset(
    model_set: ModelSet, base: Estimate, fitted_values: FittedValues
) -> ScreeningSubset:
    """Return the recordings that are screened first, evenly spread over all, with their base."""
    count = len(model_set.series)
    screened = min(max(round(SCREENED_FRACTION * count), MIN_SCREENED), MAX_SCREENED)
    if count <= screened:
        return ScreeningSubset(list(range(count)), model_set, base, fitted_values)
    rows = [round(k * (count - 1) / (screened - 1)) for k in range(screened)]
    series = tuple(model_set.series[row] for row in rows)
    parts = [base.prediction.slices[row] for row in rows]
    columns = {name: np.concatenate([c[p] for p in parts]) for name, c in base.jacobian.items()}
    seen = evaluate_with_gains_of(
        base, series, ParameterVector(base.point.shared, base.point.per_recording[rows])
    )
    own = dataclasses.replace(model_set, series=series)
    seen = dataclasses.replace(seen, jacobian=columns)
    return ScreeningSubset(
        rows, own, dataclasses.replace(seen, cost=_reference_cost(seen, series)), fitted_values
    )


def _reference_cost(base: Estimate, series: Sequence[SampledRecording]) -> float:
    """Return the cost [nats] of a base that takes the steps that candidates take, with gains made
    where it begins: those that it was left with may fit better by accident.
    """
    here = evaluate(base.candidate, series, base.noise_levels, base.point, base.prediction)
    return refresh_gains(
        iterate_with_jacobian(here, series, base.jacobian, SCREENING_ITERATIONS), series
    ).cost


@dataclass(frozen=True)
class _SubsetResult:
    """What a candidate `found` on some recordings, of which these have `seen` anything or none has;
    its `gain` [nats] is that of as many as there are, its `point` one of all.
    """

    estimate: Estimate = field(repr=False)
    point: ParameterVector = field(repr=False)
    gain: float
    is_shown_by_subset: bool = True


def _screen_starts(subset: ScreeningSubset, candidate: Candidate) -> Estimate:
    """Return a candidate few steps from the best of its starts, on some recordings."""
    starts = _start_points(subset, candidate)
    make = partial(_halve_starts, subset, candidate, starts)
    base = subset.base
    given = [base.candidate, base.point, base.noise_levels, base.jacobian, *starts]
    return subset.model_set.load_or_fit("begun", candidate, given, make)


def _screen_on_subset(
    model_set: ModelSet,
    subset: ScreeningSubset,
    screened: Estimate,
    base: Estimate,
    min_gain: float,
) -> _SubsetResult:
    """Return what some recordings say of a candidate; where that is nothing, what all say of where
    it starts and of where it was led to: some show themselves in few recordings alone.
    """
    candidate = screened.candidate
    make = partial(_continue_screening, subset, screened)
    given = [base.candidate, base.jacobian, screened.point, screened.noise_levels, screened.gains]
    found = subset.model_set.load_or_fit("hinted", candidate, given, make)
    gain = subset.base.cost - found.cost
    whole = extend_vector(candidate, base.candidate, base.point, {})
    whole.per_recording[subset.rows] = found.point.per_recording
    point = ParameterVector(found.point.shared, whole.per_recording)
    if gain >= min_gain or subset.model_set is model_set:
        return _SubsetResult(found, point, gain * len(model_set.series) / len(subset.rows))
    first = extend_vector(
        candidate, base.candidate, base.point, start_values(candidate, base.values(0))[0]
    )
    ends = [evaluate_with_gains_of(found, model_set.series, point)]
    if (
        evaluate_with_gains_of(found, subset.model_set.series, subset.point(first)).cost
        < subset.base.cost + MAX_START_LOSS
    ):
        ends.append(evaluate_near(candidate, model_set.series, base.noise_levels, first, base))
    best = min(ends, key=lambda one: one.cost)
    return _SubsetResult(found, best.point, base.cost - best.cost, is_shown_by_subset=False)


def _screen_on_all(
    model_set: ModelSet, subset: ScreeningSubset, base: Estimate, result: _SubsetResult
) -> Estimate:
    """Return a candidate some steps further on all recordings: from where some led it, and from its
    starts where these show nothing of it.
    """
    if subset.model_set is model_set:
        return result.estimate
    candidate = result.estimate.candidate
    whole = ScreeningSubset(
        list(range(len(model_set.series))), model_set, base, subset.fitted_values
    )
    starts = [result.point, *_start_points(whole, candidate)]
    make = partial(_screen_from, whole, candidate, starts)
    given = [base.candidate, base.point, base.noise_levels, base.jacobian, *starts]
    return model_set.load_or_fit("screened", candidate, given, make)


def _start_points(subset: ScreeningSubset, candidate: Candidate) -> list[ParameterVector]:
    base = subset.base
    starts = start_values(candidate, base.values(0))
    known = (
        subset.fitted_values.get(candidate.placed_effects[-1].id, {})
        if candidate.placed_effects
        else {}
    )
    if known and known.keys() <= starts[0].keys():
        starts.append({**starts[0], **known})
    return [extend_vector(candidate, base.candidate, base.point, start) for start in starts]


def _screen_from(
    subset: ScreeningSubset, candidate: Candidate, starts: Sequence[ParameterVector]
) -> Estimate:
    """Return a candidate some steps from the best of some starts, on a part of the recordings."""
    return _continue_screening(subset, _halve_starts(subset, candidate, starts))


def _halve_starts(
    subset: ScreeningSubset, candidate: Candidate, starts: Sequence[ParameterVector]
) -> Estimate:
    """Return a candidate few steps from the best of some starts.

    How the base's parameters act is taken from the base.
    """
    series = subset.model_set.series
    found: list[Estimate] = []
    near: PredictionResult | None = None
    for point in starts:
        here = (
            evaluate_near(candidate, series, subset.base.noise_levels, point, subset.base)
            if near is None
            else evaluate(candidate, series, subset.base.noise_levels, point, near)
        )
        near = here.prediction if here.prediction.is_complete else near
        found.append(restart_phases(here, series))
    found.sort(key=lambda one: one.cost)
    most = MAX_STARTS_BESIDE if subset.base.candidate.placed_effects else MAX_STARTS
    race = [
        iterate_with_jacobian(here, series, subset.base.jacobian, HALVING_ITERATIONS)
        for here in found[:most]
    ]
    return min(race, key=lambda one: one.cost)


def _continue_screening(subset: ScreeningSubset, screened: Estimate) -> Estimate:
    """Return a candidate some steps further, its phases turned again where that is better."""
    series, columns = subset.model_set.series, subset.base.jacobian
    best = refresh_gains(
        iterate_with_jacobian(screened, series, columns, SCREENING_ITERATIONS - HALVING_ITERATIONS),
        series,
    )
    again = restart_phases(best, series)
    if again.cost > best.cost - MIN_SCREENING_GAIN:
        return best
    return refresh_gains(
        iterate_with_jacobian(again, series, columns, SCREENING_ITERATIONS), series
    )


def start_values(candidate: Candidate, base: Mapping[str, float]) -> list[dict[str, float]]:
    """Return the starts of a candidate's fit:
    values of the parameters that the base does not have.
    """
    own = [one for one in candidate.free_parameters if one.name not in base]
    most = max((len(one.starts) for one in own if not one.per_recording), default=1)
    return [{one.name: one.starts[min(k, len(one.starts) - 1)] for one in own} for k in range(most)]
